// A scene in the terms that all engines share: one box, sphere or hull per body, some bodies fixed.
// Masses and inertias are worked out here once, so that every engine gets the same bodies.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/peers/polyhedron.h"
#include "scenes/scene.h"

namespace skerry::peers {

enum class Form : std::uint8_t { box, sphere, hull };

struct PeerShape {
  Form form = Form::box;
  Vec3 half_extents = Vec3::Zero();  // of a box
  double radius = 0;                 // of a sphere
  Polyhedron solid;                  // of a box or hull
};

struct PeerBody {
  std::uint32_t shape = 0;  // row of PeerScene::shapes
  bool fixed = false;
  Pose pose;
  Vec3 linear_velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();
  double mass = 0;              // kg; 0 if fixed
  Vec3 inertia = Vec3::Zero();  // kg m^2, principal, along the body's axes
  double friction = 0;          // a pair combines by sqrt(a*b)
};

struct PeerScene {
  scenes::SceneDesc source;
  std::vector<PeerShape> shapes;  // each different one once
  std::vector<PeerBody> bodies;   // in the scene's order
};

// Throws std::invalid_argument, naming the body, for what one of the engines could not be given in
// the same way: other shapes, compounds, joints, force fields, events, restitution, damping.
PeerScene make_peer_scene(scenes::SceneDesc scene);

}  // namespace skerry::peers
