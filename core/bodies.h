// Body arrays. A body's row is its id's index for as long as it lives; freed rows are holes until
// the lowest one is taken again. Hot arrays apart from cold ones.
#pragma once

#include <cstdint>
#include <vector>

#include <skerry/body.h>
#include <skerry/ids.h>
#include <skerry/types.h>

namespace skerry::core {

// Dense row of a body inside one step. Users hold BodyId; the two do not convert.
using BodyIndex = std::uint32_t;
using ColliderIndex = std::uint32_t;
inline constexpr std::uint32_t kNone = 0xffffffffu;

enum BodyFlag : std::uint32_t {
  kAlive = 1u << 0,
  kDynamic = 1u << 1,
  kKinematic = 1u << 2,  // neither: fixed
  kAwake = 1u << 3,      // dynamic: simulated; kinematic: has a velocity; never for fixed
  kAllowSleep = 1u << 4,
  kIsotropic = 1u << 5,    // inertia is a multiple of identity: no gyroscopic term
  kQuarantined = 1u << 6,  // state went non-finite: frozen at its last good pose, collides no more
  kChanged = 1u << 7,      // pose changed in the last step
  kLockShift = 8,          // bits 8..13: translation x,y,z then rotation x,y,z locked
  kLockX = 1u << 8,
  kLockY = 1u << 9,
  kLockZ = 1u << 10,
  kLockRx = 1u << 11,
  kLockRy = 1u << 12,
  kLockRz = 1u << 13,
  kLockMask = 0x3fu << 8,
  kContinuous = 1u << 14,  // dynamic, and swept when fast (core/fast_bodies.h)
  kFast = 1u << 15,        // moved so far in the last step that it was swept
  kForced = 1u << 16,      // `force` holds something
  kDisturbed = 1u << 17,  // fixed or kinematic, and changed by hand since the last step: wakes whom
                          // it meets
  kReloaded = 1u << 18,   // dynamic: its load was changed by hand since the last step
  kCentred = 1u << 19,    // the centre of mass is the origin of the body frame
};

// Pose of the centre of mass; the axes are those of the body frame.
struct BodyPose {
  Vec3 center = Vec3::Zero();           // m, world
  Quat orientation = Quat::Identity();  // unit
};

struct BodyMotion {
  Vec3 linear = Vec3::Zero();            // m/s, of the centre of mass
  Vec3 angular = Vec3::Zero();           // rad/s, world; follows from angular_momentum if dynamic
  Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s about the centre, world; the primary quantity
};

// J, of a dynamic body.
inline double kinetic_energy(const BodyMotion& motion, double mass) {
  return 0.5 * (mass * motion.linear.squaredNorm() + motion.angular_momentum.dot(motion.angular));
}

// The first cache line has all that a body of isotropic inertia needs in a solve.
struct alignas(64) BodyMass {
  double mass = 0;      // kg; 0 unless dynamic
  double inv_mass = 0;  // 1/kg
  double gravity_scale = 1;
  double linear_damping = 0;          // 1/s
  double angular_damping = 0;         // 1/s
  double radius = 0;                  // m, of the sphere about the centre that holds all shapes
  float inner_radius = 0;             // m, of the smallest ball inside one of the solid shapes
  float turn_radius = 0;              // m, how far a turn by one radian can move a point of them
  Mat3 inv_inertia_b = Mat3::Zero();  // kg^-1 m^-2 about the centre, body axes
  Vec3 local_center = Vec3::Zero();   // m, centre of mass in the body frame
  Mat3 inertia_b = Mat3::Zero();      // kg m^2, inverse of inv_inertia_b
};

struct BodyForce {
  Vec3 force = Vec3::Zero();   // N, user forces gathered for the coming step; cleared by it
  Vec3 torque = Vec3::Zero();  // N m
};

// What a body is while it is dynamic, kept while it is not.
struct DynamicTraits {
  double mass = 0;              // kg; 0: it cannot be dynamic
  Mat3 inertia = Mat3::Zero();  // kg m^2 about the centre, body axes
  std::uint32_t flags = 0;      // kContinuous, kIsotropic, locks
};

struct Bodies {
  // [rows], rows = highest index ever used + 1
  std::vector<std::uint32_t> flags;
  std::vector<BodyPose> pose;
  std::vector<BodyMotion> motion;
  std::vector<BodyMass> mass;
  std::vector<DynamicTraits> as_dynamic;
  std::vector<BodyForce> force;               // zero unless kForced; see add_force
  std::vector<float> still_time;              // s below the sleep thresholds
  std::vector<double> still_energy;           // J, kinetic, when still_time began to count
  std::vector<std::uint32_t> sleep_island;    // row of Sleepers::islands, kNone while awake
  std::vector<std::uint32_t> lock_joints;     // how many joints with locks it has
  std::vector<ColliderIndex> first_collider;  // chain through Collider::next_in_body, kNone: none
  std::vector<std::uint32_t> generation;
  std::vector<std::uint64_t> user_data;

  std::vector<BodyIndex> free_rows;  // min-heap order not needed: kept sorted descending
  std::vector<BodyIndex> awake;      // ascending; dynamic and moving kinematic bodies
  bool awake_stale = false;          // flags changed: rebuild `awake` before the next use
  std::vector<BodyIndex> disturbed;  // kDisturbed ones, as they were marked

  std::uint32_t rows() const { return static_cast<std::uint32_t>(flags.size()); }
  bool is(BodyIndex body, std::uint32_t bits) const { return (flags[body] & bits) == bits; }
  bool alive(BodyId id) const {
    return id.index < rows() && (flags[id.index] & kAlive) && generation[id.index] == id.generation;
  }
  BodyId id(BodyIndex body) const { return {body, generation[body]}; }
};

// World inverse inertia R I^-1 R^T (kg^-1 m^-2) with rows and columns of locked axes cleared.
Mat3 inv_inertia_w(const BodyMass& mass, const Quat& orientation, std::uint32_t flags);
// World inertia R I R^T.
Mat3 inertia_w(const BodyMass& mass, const Quat& orientation);

// Takes a row (the lowest free one, or a new one) with a fresh generation; flags are kAlive only.
BodyIndex take_row(Bodies& bodies);
void free_row(Bodies& bodies, BodyIndex body);

// Sets velocities so that linear, angular and angular momentum agree (locks respected).
void set_motion(Bodies& bodies, BodyIndex body, const Vec3& linear, const Vec3& angular);

// Marks a body that cannot react as kDisturbed, for the coming step.
void disturb(Bodies& bodies, BodyIndex body);
void forget_disturbed(Bodies& bodies);

// For the coming step.
void add_force(Bodies& bodies, BodyIndex body, const Vec3& force, const Vec3& torque);

// Rebuilds `awake` from the flags if stale.
void refresh_awake(Bodies& bodies);

// The pose of a body's frame.
Pose body_frame(const Bodies& bodies, BodyIndex body);
// The body frame's pose of a body whose centre-of-mass pose is given, and back.
Pose body_frame(const BodyPose& pose, const Vec3& local_center);
BodyPose center_frame(const Pose& pose, const Vec3& local_center);

}  // namespace skerry::core
