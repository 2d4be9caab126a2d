// Turns the items of a scene file's body lists (bodies, prefab instances, repeaters) into bodies and
// joints.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "scenes/body_reader.h"
#include "scenes/lcg.h"

namespace skerry::scenes {

// The bodies that can be named at one level of the file: the top, or the inside of a prefab.
using Scope = std::map<std::string, BodyNumber>;

class ItemExpander {
 public:
  ItemExpander(const SceneLibrary& library, std::uint64_t seed) : library_(library), seed_(seed) {}

  // Appends the bodies of a list whose frame has this pose in the world, and their names.
  void expand(const JsonNode& list, const Pose& frame, Scope& scope);
  void expand_item(const JsonNode& item, const Pose& frame, Scope& scope);
  // Appends the joints of a list; they name bodies of the scope.
  void join(const JsonNode& list, const Pose& frame, const Scope& scope);

  // Everything so far, and the value in the file that each came from.
  std::vector<BodyDesc> bodies;
  std::vector<const JsonNode*> body_origins;
  std::vector<SceneJoint> joints;
  std::vector<const JsonNode*> joint_origins;

  // Expands the prefabs that nothing used, to find their mistakes, and forgets the result.
  void check_unused_prefabs();

 private:
  // Before `more` bodies at least are added: a million is the limit.
  void check_room(std::size_t more, const JsonNode& where) const;
  void add_body(const JsonNode& item, const Pose& frame, Scope& scope);
  void add_instance(const JsonNode& item, const Pose& frame, Scope& scope);
  void add_grid(const JsonNode& item, const Pose& frame, Scope& scope);
  void add_stack(const JsonNode& item, const Pose& frame, Scope& scope);
  void add_pile(const JsonNode& item, const Pose& frame, Scope& scope);
  void add_copy(const JsonNode& item, const JsonNode& repeater, std::size_t copy, const Pose& frame,
                Scope& scope);
  void open_prefab(const std::string& name, const JsonNode& user, const Pose& frame, Scope& scope);
  Lcg random_of(const JsonNode& repeater) const;

  const SceneLibrary& library_;
  std::uint64_t seed_;
  std::map<const JsonNode*, BodyDesc> read_;  // each body is read once, however often it is placed
  std::vector<std::string> open_;             // prefabs being expanded
  std::set<std::string> used_;
};

// The number behind a name, or SceneError.
BodyNumber find_body(const Scope& scope, const JsonNode& name);

}  // namespace skerry::scenes
