#include "apps/measure/difference.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <vector>

namespace skerry::measure {
namespace {

struct Value {
  const char* name;
  double value;
};

std::vector<Value> values_of(const World& world, BodyId body) {
  const Pose pose = world.pose(body);
  const Vec3 v = world.linear_velocity(body);
  const Vec3 w = world.angular_velocity(body);
  const Vec3 l = world.angular_momentum(body);
  return {{"position.x", pose.position.x()},
          {"position.y", pose.position.y()},
          {"position.z", pose.position.z()},
          {"orientation.x", pose.orientation.x()},
          {"orientation.y", pose.orientation.y()},
          {"orientation.z", pose.orientation.z()},
          {"orientation.w", pose.orientation.w()},
          {"linear_velocity.x", v.x()},
          {"linear_velocity.y", v.y()},
          {"linear_velocity.z", v.z()},
          {"angular_velocity.x", w.x()},
          {"angular_velocity.y", w.y()},
          {"angular_velocity.z", w.z()},
          {"angular_momentum.x", l.x()},
          {"angular_momentum.y", l.y()},
          {"angular_momentum.z", l.z()},
          {"awake", world.awake(body) ? 1.0 : 0.0}};
}

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

}  // namespace

std::string first_difference(const World& actual, const World& expected) {
  const auto bodies = actual.bodies();
  const auto others = expected.bodies();
  if (!std::equal(bodies.begin(), bodies.end(), others.begin(), others.end())) {
    return "the bodies that exist";
  }
  for (const BodyId body : bodies) {
    const std::vector<Value> a = values_of(actual, body);
    const std::vector<Value> b = values_of(expected, body);
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (same_bits(a[i].value, b[i].value)) continue;
      std::array<char, 128> text;
      std::snprintf(text.data(), text.size(), "body %u, %s: %.17g instead of %.17g", body.index,
                    a[i].name, a[i].value, b[i].value);
      return text.data();
    }
  }
  return "the events";
}

}  // namespace skerry::measure
