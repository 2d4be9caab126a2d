#include "bench/peers/quality.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace skerry::peers {
namespace {

double kinetic_energy(const PeerBody& body, const BodyState& state) {
  const Vec3 spin = state.pose.orientation.conjugate() * state.angular_velocity;
  return 0.5 * (body.mass * state.linear_velocity.squaredNorm() +
                body.inertia.dot(spin.cwiseProduct(spin)));
}

// How far from the middle the fixed bodies (unturned boxes in all common scenes) reach in x and z.
Vec3 reach(const PeerScene& scene) {
  Vec3 far = Vec3::Zero();
  for (const PeerBody& body : scene.bodies) {
    if (!body.fixed) continue;
    for (const Vec3& p : scene.shapes[body.shape].solid.points) {
      far = far.cwiseMax((body.pose.orientation * p + body.pose.position).cwiseAbs());
    }
  }
  return far;
}

bool is_outside(const Vec3& position, const Vec3& reach) {
  // Negated, so that a position that is not a number counts.
  return !(position.y() >= 0 && std::abs(position.x()) <= reach.x() &&
           std::abs(position.z()) <= reach.z());
}

}  // namespace

Quality measure_quality(const PeerScene& scene, std::span<const BodyState> states) {
  Quality quality = {.penetration = measure_penetration(scene, states),
                     .top_y = -std::numeric_limits<double>::infinity()};
  const Vec3 far = reach(scene);
  double moving = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const PeerBody& body = scene.bodies[i];
    if (body.fixed) continue;
    const Vec3& at = states[i].pose.position;
    moving += 1;
    quality.kinetic_energy += kinetic_energy(body, states[i]);
    quality.largest_drift = std::max(quality.largest_drift, (at - body.pose.position).norm());
    quality.mean_y += at.y();
    quality.top_y = std::max(quality.top_y, at.y());
    quality.escaped += is_outside(at, far) ? 1 : 0;
  }
  quality.mean_y /= std::max(moving, 1.0);
  return quality;
}

}  // namespace skerry::peers
