// Keeps account of contact events: begins and ends must alternate, in the order that is promised.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <tuple>
#include <vector>

#include <skerry/world.h>

namespace skerry::test {

class EventLedger {
 public:
  // Takes in the events of the last step.
  void read(const World& world) {
    const auto events = world.contact_events();
    for (std::size_t i = 0; i < events.size(); ++i) {
      const ContactEvent& event = events[i];
      ASSERT_LT(event.a.index, event.b.index);
      if (i > 0) {
        ASSERT_LT(order_of(events[i - 1]), order_of(event)) << "event " << i;
      }
      take(event);
    }
  }

  std::size_t open() const { return open_.size(); }
  bool is_open(BodyId a, BodyId b) const {
    for (const auto& [pair, sensor] : open_)
      if ((std::get<0>(pair) == a && std::get<1>(pair) == b) ||
          (std::get<0>(pair) == b && std::get<1>(pair) == a))
        return true;
    return false;
  }
  int begins() const { return begins_; }
  int ends() const { return ends_; }
  int hits() const { return hits_; }

 private:
  using Pair = std::tuple<BodyId, BodyId, std::uint32_t, std::uint32_t>;
  using Order = std::tuple<BodyId, BodyId, std::uint32_t, std::uint32_t, int>;

  static Order order_of(const ContactEvent& event) {
    const int rank = event.kind == ContactEventKind::end ? -1 : static_cast<int>(event.kind);
    return {event.a, event.b, event.shape_a, event.shape_b, rank};
  }

  void take(const ContactEvent& event) {
    const Pair pair = {event.a, event.b, event.shape_a, event.shape_b};
    const auto found = open_.find(pair);
    if (event.kind == ContactEventKind::begin) {
      EXPECT_EQ(found, open_.end()) << "began twice: " << event.a.index << " " << event.b.index;
      open_[pair] = event.sensor;
      ++begins_;
      return;
    }
    ASSERT_NE(found, open_.end()) << "never began: " << event.a.index << " " << event.b.index;
    EXPECT_EQ(found->second, event.sensor);
    hits_ += event.kind == ContactEventKind::hit;
    if (event.kind != ContactEventKind::end) return;
    open_.erase(found);
    ++ends_;
  }

  std::map<Pair, bool> open_;
  int begins_ = 0, ends_ = 0, hits_ = 0;
};

}  // namespace skerry::test
