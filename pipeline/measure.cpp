#include "pipeline/measure.h"

#include <algorithm>

#include "core/hash.h"
#include "pipeline/world_data.h"

namespace skerry::pipeline {
namespace {

void measure_bodies(const WorldData& world, Measures& out) {
  const core::Bodies& bodies = world.bodies;
  Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
  for (core::BodyIndex body = 0; body < bodies.rows(); ++body) {
    if (!bodies.is(body, core::kAlive | core::kDynamic)) continue;
    const core::BodyMass& mass = bodies.mass[body];
    const core::BodyMotion& motion = bodies.motion[body];
    const Vec3 p = mass.mass * motion.linear;
    const Vec3& center = bodies.pose[body].center;
    out.kinetic_energy += core::kinetic_energy(motion, mass.mass);
    out.potential_energy -= mass.mass * mass.gravity_scale * world.settings.gravity.dot(center);
    momentum += p;
    angular += motion.angular_momentum + center.cross(p);
  }
  for (int i = 0; i < 3; ++i) {
    out.momentum[static_cast<std::size_t>(i)] = momentum[i];
    out.angular_momentum[static_cast<std::size_t>(i)] = angular[i];
  }
}

void measure_contacts(const WorldData& world, Measures& out) {
  double sum = 0;
  for (const core::ContactPair& pair : world.contacts.pairs) {
    if (!(pair.flags & core::kTouching) || (pair.flags & core::kSensorPair)) continue;
    for (std::uint32_t m = 0; m < pair.manifold_count; ++m) {
      const core::Manifold& manifold = world.contacts.manifolds[pair.first_manifold + m];
      for (std::uint32_t i = 0; i < manifold.point_count; ++i) {
        const double depth = -double(manifold.points[i].separation);
        if (depth < 0) continue;
        ++out.contact_points;
        sum += depth;
        out.penetration_max = std::max(out.penetration_max, depth);
      }
    }
  }
  if (out.contact_points > 0) out.penetration_mean = sum / double(out.contact_points);
}

void measure_effects(const WorldData& world, ContactMeasures& out) {
  Vec3 impulse = Vec3::Zero();
  for (const core::BodyEffect& body : world.effects.bodies) {
    out.energy_lost += body.energy_lost;
    impulse += body.impulse;
  }
  for (int i = 0; i < 3; ++i) out.impulse_from_ground[static_cast<std::size_t>(i)] = impulse[i];
  ContactLaw& law = out.law;
  double sum = 0;
  for (const core::ContactResidual& contact : world.effects.contacts) {
    out.normal_impulse += contact.total_impulse;
    if (contact.normal_impulse <= 0 && contact.pull <= 0) continue;
    ++law.manifolds;
    sum += contact.normal_impulse;
    law.pull_max = std::max(law.pull_max, contact.pull);
    law.cone_mean += contact.cone;
    law.cone_max = std::max(law.cone_max, contact.cone);
    law.normal_mean += contact.normal;
    law.normal_max = std::max(law.normal_max, contact.normal);
    law.friction_mean += contact.friction;
    law.friction_max = std::max(law.friction_max, contact.friction);
  }
  if (sum <= 0) return;
  const auto count = double(law.manifolds);
  law.impulse_mean = sum / count;
  for (double* part : {&law.pull_max, &law.cone_max, &law.normal_max, &law.friction_max})
    *part /= law.impulse_mean;
  for (double* part : {&law.cone_mean, &law.normal_mean, &law.friction_mean}) *part /= sum;
}

void add(core::StateHasher& hasher, const Vec3& v) {
  hasher.add(v.x());
  hasher.add(v.y());
  hasher.add(v.z());
}

void add_body(core::StateHasher& hasher, const core::Bodies& bodies, core::BodyIndex body) {
  const core::BodyPose& pose = bodies.pose[body];
  const core::BodyMotion& motion = bodies.motion[body];
  hasher.add(std::uint64_t{body});
  hasher.add(std::uint64_t{bodies.flags[body] & (core::kAwake | core::kQuarantined)});
  add(hasher, pose.center);
  hasher.add(pose.orientation.x());
  hasher.add(pose.orientation.y());
  hasher.add(pose.orientation.z());
  hasher.add(pose.orientation.w());
  add(hasher, motion.linear);
  add(hasher, motion.angular);
  add(hasher, motion.angular_momentum);
}

void add_event(core::StateHasher& hasher, const ContactEvent& event) {
  hasher.add((std::uint64_t{event.a.index} << 32) | event.b.index);
  hasher.add((std::uint64_t{event.a.generation} << 32) | event.b.generation);
  hasher.add((std::uint64_t{event.shape_a} << 32) | event.shape_b);
  hasher.add((static_cast<std::uint64_t>(event.kind) << 1) | std::uint64_t{event.sensor});
  add(hasher, event.point);
  add(hasher, event.normal);
  hasher.add(event.impulse);
  hasher.add(event.approach_speed);
}

}  // namespace

Measures measure(const WorldData& world) {
  Measures out;
  measure_bodies(world, out);
  measure_contacts(world, out);
  measure_effects(world, out.contacts);
  return out;
}

std::uint64_t state_hash(const WorldData& world) {
  core::StateHasher hasher;
  for (core::BodyIndex body = 0; body < world.bodies.rows(); ++body) {
    if (world.bodies.is(body, core::kAlive)) add_body(hasher, world.bodies, body);
  }
  for (const ContactEvent& event : world.events) add_event(hasher, event);
  for (const JointBroken& broken : world.broken) {
    hasher.add((std::uint64_t{broken.joint.index} << 32) | broken.joint.generation);
    add(hasher, broken.force);
    add(hasher, broken.torque);
  }
  return hasher.finish();
}

}  // namespace skerry::pipeline
