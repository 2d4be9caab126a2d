#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/broadphase_kinds.h"
#include "collision/proxy_broadphase.h"

namespace skerry::collision {
namespace {

// Along this axis boxes are sorted. Worlds are wide in x more often than in y (up).
constexpr int kAxis = 0;

struct Entry {
  float low;  // Aabb::min[kAxis] at the last sort
  ColliderIndex collider;
  friend bool operator<(const Entry& a, const Entry& b) {
    return a.low != b.low ? a.low < b.low : a.collider < b.collider;
  }
};

// Boxes whose width lies within a factor of four, sorted by their lower side: those that meet a
// box lie between its lower side less the greatest width, and its upper side.
struct SizeClass {
  std::vector<Entry> entries;
  float widest = 0;  // m, at least that of every box
  bool unsorted = false;
};

class SweepBroadphase final : public ProxyBroadphase {
 protected:
  void insert(ColliderIndex collider, const Aabb& box, bool fixed) override {
    if (collider >= rows_.size()) rows_.resize(collider + 1);
    rows_[collider] = {box, class_of(box), fixed};
    SizeClass& sizes = classes_[rows_[collider].size_class];
    sizes.entries.push_back({box.min[kAxis], collider});
    sizes.unsorted = true;
  }

  void erase(ColliderIndex collider, bool) override {
    SizeClass& sizes = classes_[rows_[collider].size_class];
    std::erase_if(sizes.entries, [=](const Entry& entry) { return entry.collider == collider; });
  }

  void move(std::span<const ColliderIndex> moved, Task&) override {
    for (const ColliderIndex collider : moved)
      move_one(collider, fat_bounds(collider), is_fixed(collider));
  }

  void settle(Task&) override {
    for (SizeClass& sizes : classes_)
      if (sizes.unsorted) sort(sizes);
  }

  void find(const Aabb& box, bool with_fixed, std::vector<ColliderIndex>& found) const override {
    for (const SizeClass& sizes : classes_) {
      if (sizes.entries.empty()) continue;
      const Entry first{std::nextafter(box.min[kAxis] - sizes.widest, -kInf), 0};
      auto entry = std::lower_bound(sizes.entries.begin(), sizes.entries.end(), first);
      for (; entry != sizes.entries.end() && entry->low <= box.max[kAxis]; ++entry) {
        const Row& row = rows_[entry->collider];
        if ((with_fixed || !row.fixed) && overlap(row.box, box)) found.push_back(entry->collider);
      }
    }
  }

 private:
  void move_one(ColliderIndex collider, const Aabb& box, bool fixed) {
    if (class_of(box) != rows_[collider].size_class) {
      erase(collider, fixed);
      insert(collider, box, fixed);
      return;
    }
    rows_[collider].box = box;
    classes_[rows_[collider].size_class].unsorted = true;
  }

  static constexpr float kInf = std::numeric_limits<float>::infinity();
  static constexpr int kClasses = 128;

  struct Row {
    Aabb box;
    int size_class = 0;
    bool fixed = false;
  };

  static float width(const Aabb& box) {
    return std::nextafter(box.max[kAxis] - box.min[kAxis], kInf);
  }
  static int class_of(const Aabb& box) {
    int exponent = 0;
    std::frexp(width(box), &exponent);
    return std::clamp(exponent / 2 + kClasses / 2, 0, kClasses - 1);
  }

  void sort(SizeClass& sizes) {
    sizes.widest = 0;
    std::size_t inversions = 0;
    for (std::size_t i = 0; i < sizes.entries.size(); ++i) {
      Entry& entry = sizes.entries[i];
      const Aabb& box = rows_[entry.collider].box;
      entry.low = box.min[kAxis];
      sizes.widest = std::max(sizes.widest, width(box));
      inversions += i > 0 && entry < sizes.entries[i - 1];
    }
    if (inversions > sizes.entries.size() / 8)
      std::sort(sizes.entries.begin(), sizes.entries.end());
    else
      insertion_sort(sizes.entries);
    sizes.unsorted = false;
  }

  // Nearly sorted from the step before.
  static void insertion_sort(std::vector<Entry>& entries) {
    for (std::size_t i = 1; i < entries.size(); ++i) {
      const Entry entry = entries[i];
      std::size_t at = i;
      for (; at > 0 && entry < entries[at - 1]; --at) entries[at] = entries[at - 1];
      entries[at] = entry;
    }
  }

  std::vector<Row> rows_;  // [collider]
  SizeClass classes_[kClasses];
};

}  // namespace

std::unique_ptr<Broadphase> make_sweep_broadphase() { return std::make_unique<SweepBroadphase>(); }

}  // namespace skerry::collision
