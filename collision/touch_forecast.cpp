#include "collision/touch_forecast.h"

#include <algorithm>
#include <cmath>

#include "core/rounding.h"
#include "core/trig.h"

namespace skerry::collision {

using core::BodyIndex;
using core::cross;
using core::dot;

namespace {

constexpr float kNever = 3e38f;
// m: a smaller gap is a touch. The solver counts it as none.
constexpr float kTouch = 1e-5f;
constexpr float kClose = 2e-3f;  // m
// Inner radii of the smaller body.
constexpr float kFar = 4;
// Rounding of places, as a part of the distance of the two centres.
constexpr float kRounding = 1e-6f;

Quat turned(const Quat& orientation, const Vec3& turn) {
  const double angle = turn.norm();
  if (angle == 0) return orientation;
  const auto [sin, cos] = core::trig::sin_cos(0.5 * angle);
  const Vec3 v = turn * (sin / angle);
  return Quat(Quat(cos, v.x(), v.y(), v.z()) * orientation).normalized();
}

Vec3 gravity_on(const StepContext& step, BodyIndex body) {
  if (!step.bodies->is(body, core::kDynamic)) return Vec3::Zero();
  return step.bodies->mass[body].gravity_scale * step.settings->gravity;
}

BodyAt body_at(const StepContext& step, BodyIndex body, double time) {
  const core::Bodies& bodies = *step.bodies;
  const core::BodyMotion& motion = bodies.motion[body];
  BodyAt at = {bodies.pose[body], motion.linear, motion.angular};
  const std::uint32_t flags = bodies.flags[body];
  if (!(flags & (core::kDynamic | core::kKinematic))) return at;
  const Vec3 acceleration = gravity_on(step, body);
  at.pose.center += time * motion.linear + (0.5 * time * time) * acceleration;
  at.linear += time * acceleration;
  if (motion.angular.isZero(0)) return at;
  if (!(flags & core::kDynamic) || flags & (core::kIsotropic | core::kLockMask)) {
    at.pose.orientation = turned(at.pose.orientation, time * motion.angular);
    return at;
  }
  const core::BodyMass& mass = bodies.mass[body];
  const auto spin = [&](const Quat& q) -> Vec3 {
    return core::inv_inertia_w(mass, q, flags) * motion.angular_momentum;
  };
  const Quat halfway = turned(at.pose.orientation, (0.5 * time) * motion.angular);
  at.pose.orientation = turned(at.pose.orientation, time * spin(halfway));
  at.angular = spin(at.pose.orientation);
  return at;
}

float moved(const core::BodyPose& start, const core::BodyPose& then, const Vec3& arm,
            const Vec3& normal) {
  const Quat turn = then.orientation * start.orientation.conjugate();
  return core::rounded_to_float(normal.dot(then.center - start.center + (turn * arm - arm)));
}

}  // namespace

PairAt pair_at(const StepContext& step, const core::ContactPair& pair, float time) {
  return {body_at(step, pair.body_a, double(time)), body_at(step, pair.body_b, double(time))};
}

TouchForecast::TouchForecast(const StepContext& step, const core::ContactPair& pair,
                             const V3f& linear, const V3f& angular)
    : step_(step),
      pair_(pair),
      linear_(linear),
      angular_(angular),
      acceleration_(
          core::to_float(Vec3(gravity_on(step, pair.body_b) - gravity_on(step, pair.body_a)))),
      restitution_(
          core::combined_restitution(step.colliders->rows[pair.a], step.colliders->rows[pair.b])),
      dt_(core::rounded_to_float(step.dt)) {}

bool may_bounce(const StepContext& step, const core::ContactPair& pair) {
  if (pair.manifold_capacity > 1 || (pair.flags & core::kSensorPair) ||
      step.settings->solver.kind != SolverKind::soft_step_tgs)
    return false;
  return core::combined_restitution(step.colliders->rows[pair.a], step.colliders->rows[pair.b]) > 0;
}

bool TouchForecast::expects(const PatchSet& patches) const {
  if (patches.count != 1 || patches.patch[0].count == 0 || is_far()) return false;
  const Meeting first = meeting(patches.patch[0], linear_, angular_);
  if (!(first.separation > kTouch)) return false;
  const float slowest = core::slowest_bounce(
      core::rounded_to_float(step_.settings->solver.restitution_threshold), restitution_);
  if (first.time < dt_ && -first.speed > slowest) return true;
  return bends_to(patches.patch[0], slowest);
}

// Whether a point that would not arrive on a straight way may do so on one that turns.
bool TouchForecast::bends_to(const ContactPatch& patch, float slowest) const {
  const auto turn = [this](core::ColliderIndex collider, BodyIndex body) {
    const auto squared = core::rounded_to_float(step_.bodies->motion[body].angular.squaredNorm());
    return squared * step_.colliders->rows[collider].turn_radius;
  };
  const float bend = turn(pair_.a, pair_.body_a) + turn(pair_.b, pair_.body_b);
  if (!(bend > 0)) return false;
  const float pull = std::min(dot(patch.normal, acceleration_), 0.0f) - bend;
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    const float vn = dot(patch.normal, linear_ + cross(angular_, patch.points[i].position));
    const float gap = patch.points[i].separation + (vn + 0.5f * pull * dt_) * dt_;
    if (gap < 0 && -(vn + pull * dt_) > slowest) return true;
  }
  return false;
}

// Whether they move on by so much in the step that what is between them now says little of where they touch.
bool TouchForecast::is_far() const {
  const auto radius = [this](BodyIndex body) {
    return step_.bodies->is(body, core::kDynamic) ? step_.bodies->mass[body].inner_radius : kNever;
  };
  const float far = kFar * std::min(radius(pair_.body_a), radius(pair_.body_b));
  const V3f speed = core::to_float(
      Vec3(step_.bodies->motion[pair_.body_b].linear - step_.bodies->motion[pair_.body_a].linear));
  return dot(speed, speed) * dt_ * dt_ > far * far;
}

TouchForecast::Meeting TouchForecast::meeting(const ContactPatch& patch, const V3f& linear,
                                              const V3f& angular) const {
  Meeting first = {kNever, kNever, 0};
  const float pull = dot(patch.normal, acceleration_);
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    const float s = patch.points[i].separation;
    first.separation = std::min(first.separation, s);
    const float vn = dot(patch.normal, linear + cross(angular, patch.points[i].position));
    // s + vn t + pull t^2 / 2 = 0
    const float squared = vn * vn - 2 * pull * s;
    if (!(squared >= 0)) continue;
    const float root = std::sqrt(squared), twice = root - vn;
    if (!(twice > 0)) continue;
    const float time = 2 * s / twice;
    if (time < first.time) {
      first.time = time;
      first.speed = -root;
    }
  }
  return first;
}

void TouchForecast::begin(const ContactPatch& patch) {
  time_ = std::min(meeting(patch, linear_, angular_).time, dt_);
}

// Whether this is the time; else goes to the next.
bool TouchForecast::arrives(const PairAt& at, const ContactPatch& patch) {
  PairFrame frame;
  pair_frame(step_, pair_, at, 0, frame);
  const Meeting next = meeting(patch, frame.linear, frame.angular);
  const float near = std::max(kTouch, kRounding * core::length(frame.between));
  if (std::fabs(next.separation) <= near) return true;
  const float then = time_ + next.time;
  if (next.separation > 0) {
    // They pass each other, or touch in another step.
    if (next.time == kNever || time_ == dt_) return true;
    before_ = time_;
    time_ = std::min(then, dt_);
  } else {
    time_ = next.time < 0 && then > before_ ? then : 0.5f * (before_ + time_);
  }
  return false;
}

// Whether they touch, more or less: a gap may jump where other features come to face each other.
bool TouchForecast::is_close(const ContactPatch& patch) {
  float gap = kNever;
  for (std::uint32_t i = 0; i < patch.count; ++i) gap = std::min(gap, patch.points[i].separation);
  return std::fabs(gap) < kClose;
}

void TouchForecast::carry_back(const PairAt& at, ContactPatch& patch,
                               std::array<float, 4>& gaps) const {
  const core::BodyPose& a = step_.bodies->pose[pair_.body_a];
  const core::BodyPose& b = step_.bodies->pose[pair_.body_b];
  const Vec3 n = core::to_double(patch.normal), between = at.b.pose.center - at.a.pose.center;
  // A rounded surface turns about the centre of its rounding.
  const auto round_a = double(rounding(step_, pair_.a, at.a.pose.orientation, patch.normal));
  const auto round_b = double(rounding(step_, pair_.b, at.b.pose.orientation, patch.normal));
  for (std::uint32_t i = 0; i < patch.count; ++i) {
    ContactPoint& point = patch.points[i];
    gaps[i] = point.separation;
    const Vec3 arm = core::to_double(point.position);
    point.separation -= moved(b, at.b.pose, arm - between + round_b * n, n) -
                        moved(a, at.a.pose, arm - round_a * n, n);
  }
}

}  // namespace skerry::collision
