#include "collision/apart_pairs.h"

#include <atomic>

#include "collision/broadphase.h"
#include "collision/motion_bounds.h"
#include "core/rounding.h"
#include "core/step_context.h"

namespace skerry::collision {

using core::BodyIndex;
using core::ContactPair;

void Travels::grow(std::uint32_t bodies) {
  if (bodies <= rows_.size()) return;
  rows_.resize(bodies);
  stops_.resize(bodies);
  watched_.resize(bodies, 0);
}

void Travels::watch(BodyIndex body) {
  // Two pairs may ask for one body at the same time.
  std::atomic_ref<std::uint8_t>(watched_[body]).store(1, std::memory_order_relaxed);
}

void Travels::update(BodyIndex body, const core::BodyPose& pose, const core::BodyMotion& motion,
                     double reach, double dt) {
  if (!watched_[body]) return;
  const Quat& q = pose.orientation;
  const Stop now = {pose.center,
                    {core::rounded_to_float(q.w()), core::rounded_to_float(q.x()),
                     core::rounded_to_float(q.y()), core::rounded_to_float(q.z())}};
  Row& row = rows_[body];
  if (row.ahead < kUnknown) {
    const Stop& last = stops_[body];
    const Vec3 gone = now.center - last.center;
    row.way += sum_of_sizes(gone) + twice_chord(now.orientation, last.orientation) * reach;
  }
  row.ahead = row.way + (sum_of_sizes(motion.linear) + sum_of_sizes(motion.angular) * reach) * dt;
  stops_[body] = now;
}

void Travels::forget(BodyIndex body) {
  rows_[body].ahead = kUnknown;
  watched_[body] = 0;
}

namespace {

// m: more than rounding can add to a distance between shapes.
constexpr double kRounding = 1e-4;

}  // namespace

ApartPairs::ApartPairs(const core::StepContext& step)
    : bodies_(*step.bodies),
      contacts_(*step.contacts),
      travels_(step.broadphase != nullptr ? &step.broadphase->travels() : nullptr) {}

bool ApartPairs::is_fixed(BodyIndex body) const {
  return !(bodies_.flags[body] & (core::kDynamic | core::kKinematic));
}

double ApartPairs::way(BodyIndex body) const { return is_fixed(body) ? 0 : travels_->way(body); }

void ApartPairs::note(const ContactPair& pair, float apart) const {
  if (travels_ == nullptr) return;
  bool known = true;
  for (const BodyIndex body : {pair.body_a, pair.body_b}) {
    if (is_fixed(body) || travels_->ahead(body) < Travels::kUnknown) continue;
    travels_->watch(body);
    known = false;
  }
  if (known)
    contacts_.apart_until[pair.first_manifold] =
        way(pair.body_a) + way(pair.body_b) + (double(apart) - kRounding);
}

}  // namespace skerry::collision
