// Joints of a scene file: their types, limits, drives and loads. The bodies are read by who knows
// their names.
#pragma once

#include <skerry/joints.h>

#include "scenes/json_document.h"

namespace skerry::scenes {

// A "joint" object of a list whose frame has this pose in the world; `a` and `b` are left out.
// Throws SceneError.
JointDesc read_joint(const JsonNode& node, const Pose& frame);

}  // namespace skerry::scenes
