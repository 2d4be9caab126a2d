// The loads that contacts begin with where bodies are put on each other at rest: those of statics.
// Left to find them, the solver passes a load on by a few contacts per pass, and what is put up sinks
// meanwhile, with the square of its height (docs/decisions/0026).
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/bodies.h"
#include "core/contacts.h"

namespace skerry::solver {

// A contact gives way to what its load exceeds what it carries by: enough to damp the slow waves of tall
// piles, which warm starting alone leaves ringing. It comes to carry half of its load. The other half
// would never come to an end where bodies lie on each other in loops, which do not fit exactly: the pile
// would creep (docs/decisions/0023). Bodies that were placed on each other come to carry most of what
// statics says: they sway less. What is left keeps all their points pressed, without which they rock.
inline constexpr float kCarriedShare = 0.5f, kPlacedShare = 0.95f;

// N s: what a contact is to carry under a load.
inline float carried_of(const core::Manifold& manifold, float load) {
  const float more = manifold.placed ? kPlacedShare - kCarriedShare : 0;
  return kCarriedShare * load + more * std::min(load, manifold.statics_impulse);
}

// Where statics has many answers the solver finds another. A contact that bears less than most of what
// statics gave it comes to be held to bear most of its load: less than all, or it would push until it did.
inline constexpr float kNear = 0.9f;
inline bool stands(float load, float statics) { return load >= kNear * statics; }

class StandingLoads {
 public:
  static constexpr std::uint32_t kGround = core::kNone;

  // Which contacts get a standing load, and with it where they begin and what they carry; one that has
  // begun before keeps its impulses unless it is `anew`.
  enum class Scope : std::uint8_t {
    begun,  // what begins (Manifold::begins), on what was there before as on ground
    all,
    all_anew,
  };

  // A contact through which one body rests on another.
  struct Support {
    std::uint32_t above, below;  // rows; kGround: bears anything
    core::Manifold* manifold;    // gets its load if it begins (Manifold::begins)
    Vec3
        shift[2];  // m, world: what takes the manifold's points to places seen from above and below
    std::uint32_t next = core::kNone;  // of the same body above
    double load = 0;                   // N, along gravity
  };

  // One island: its bodies and supports, then share(). `gravity` in m/s^2, not 0.
  void begin(std::uint32_t rows, const Vec3& gravity, double substep, Scope scope);
  void add_body(std::uint32_t row, double weight);  // N
  void add(const Support& support);
  // Writes the impulses of what begins and leads down to the ground: normal, carried, standing.
  // A body's load goes to the points that it touches as it would to springs under a rigid plate; by
  // friction and by contacts steeper than the caller's supports it hands on nothing.
  void share();

 private:
  struct Load {
    double force = 0;                   // N, its own weight included
    double moment[2] = {0, 0};          // N m: force times place, across gravity, from its centre
    std::uint32_t first = core::kNone;  // support
    std::uint32_t awaited = 0;          // bodies on it whose loads are not known yet
    bool shares = false;                // all that it rests on begins
    bool stands = false;
  };
  // A point that bears a share of a body's load.
  struct Point {
    std::uint32_t support, index;
    double place[2];  // m, across gravity, from the centre of the body above
    double share;     // N
  };

  void link();
  void sort();
  void find_ground();
  void find_points(const Load& body);
  void spread(const Load& body);
  void hand_on(const Load& body);
  bool counts(const Support& support) const;
  bool touches(const core::Manifold& manifold, std::uint32_t point) const;
  double along_normal(const core::Manifold& manifold) const;
  double across(int axis, const Support& support, std::uint32_t point, int side) const;

  double substep_ = 0, touching_ = 0;  // s, m
  Scope scope_ = Scope::begun;
  Vec3 up_, across_[2];
  std::vector<Load> loads_;                  // [rows]
  std::vector<std::uint32_t> rows_, order_;  // of the island; order_ from the top down
  std::vector<Support> supports_;
  std::vector<Point> points_;  // of the body at hand
};

}  // namespace skerry::solver
