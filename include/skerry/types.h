// Vectors, rotations and poses as the public API speaks them. SI units, right-handed frames.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace skerry {

// Eigen types whose layout compiler flags cannot change (no vectorisable alignment), so that an
// embedder may build with other -m flags than we did.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaternion<double, Eigen::DontAlign>;

// Where a body (or a shape within its body) is: x_world = orientation * x_local + position.
struct Pose {
  Vec3 position = Vec3::Zero();         // m
  Quat orientation = Quat::Identity();  // unit
};

}  // namespace skerry
