// How the world of a scene file behaves: what stands at its top level beside bodies and joints.
#pragma once

#include "scenes/json_document.h"
#include "scenes/scene.h"

namespace skerry::scenes {

// Throws SceneError.
void read_defaults(const JsonNode& root, SceneDefaults& defaults);

}  // namespace skerry::scenes
