// Pairs that were found apart need not be looked at before their bodies have come as far.
//
//   Method   a pair's distance is noted beside the sum of the ways that its two bodies had come by then;
//            it has no contact while that sum has not grown by the distance. The bound of conservative
//            advancement (Mirtich, "Impulse-based dynamic simulation of rigid body systems", 1996),
//            with the ways gone in place of velocities.
#pragma once

#include <limits>
#include <vector>

#include "core/bodies.h"
#include "core/contacts.h"

namespace skerry::core {
struct StepContext;
}

namespace skerry::collision {

// How far a pair may be apart and still get a manifold, beside what its velocity adds.
inline constexpr float kSpeculativeDistance = 0.005f;  // m

// How far bodies have come: upper bounds for any of their points, turning included. Only of bodies
// that somebody asked for: the others cost nothing.
class Travels {
 public:
  static constexpr double kUnknown = std::numeric_limits<double>::infinity();

  void grow(std::uint32_t bodies);

  // m. Between `update`s; any number of threads at once.
  double way(core::BodyIndex body) const { return rows_[body].way; }
  // m, at the end of the step if the body keeps its velocity; kUnknown unless watched.
  double ahead(core::BodyIndex body) const { return rows_[body].ahead; }
  // From the next update on the body is watched.
  void watch(core::BodyIndex body);

  // Before the narrowphase of a step; bodies apart on any number of threads. `reach`: m that a turn by
  // one radian moves a point of the body.
  void update(core::BodyIndex body, const core::BodyPose& pose, const core::BodyMotion& motion,
              double reach, double dt);
  // The body is somewhere else now, or has other shapes: what was noted of its pairs is void.
  void forget(core::BodyIndex body);

 private:
  struct Row {
    double way = 0;
    double ahead = kUnknown;
  };
  // Where `way` was last brought up to date. Rounding the orientation adds to no way: only its two
  // ends are rounded, not what lies between.
  struct Stop {
    Vec3 center = Vec3::Zero();
    float orientation[4] = {1, 0, 0, 0};  // w x y z
  };

  std::vector<Row> rows_;              // [body]
  std::vector<Stop> stops_;            // [body]
  std::vector<std::uint8_t> watched_;  // [body]
};

class ApartPairs {
 public:
  // Without a broadphase nobody watches the bodies' ways, and nothing is known.
  explicit ApartPairs(const core::StepContext& step);

  // Is the pair without a contact still, and at the end of this step? Asked of every pair: no branch
  // depends on the pair.
  bool holds(const core::ContactPair& pair) const {
    if (travels_ == nullptr) return false;
    const bool parted = (pair.manifold_count | (pair.flags & core::kTouching)) == 0;
    return bool(parted & (ahead(pair.body_a) + ahead(pair.body_b) + double(kSpeculativeDistance) <
                          contacts_.apart_until[pair.first_manifold]));
  }
  // The pair has no contact where its bodies are now; its shapes are this far apart (m) at least.
  void note(const core::ContactPair& pair, float apart) const;

 private:
  bool is_fixed(core::BodyIndex body) const;
  double way(core::BodyIndex body) const;
  // A body that is no longer awake has moved once more since its way was brought up to date.
  double ahead(core::BodyIndex body) const {
    const std::uint32_t flags = bodies_.flags[body];
    const double moving = flags & core::kAwake ? travels_->ahead(body) : Travels::kUnknown;
    return flags & (core::kDynamic | core::kKinematic) ? moving : 0;
  }

  const core::Bodies& bodies_;
  core::ContactTable& contacts_;
  Travels* travels_;
};

}  // namespace skerry::collision
