// Scene files that are wrong, each in one way, with what must be said about it; and some that are
// right. Shared by the tests of the reader and of the schema.
#pragma once

#include <string>
#include <vector>

namespace skerry::test {

struct WrongScene {
  const char* name;
  std::string text;
  const char* message;   // whole, but for the leading "wrong.json"
  bool schema_can_tell;  // or only the reader
};

std::vector<WrongScene> wrong_scenes();
std::vector<WrongScene> wrong_joints();  // part of them

// A file that uses every field there is.
std::string full_scene();

// `contents` as members of a scene object; the members begin on line 2.
std::string scene_with(const std::string& contents);

}  // namespace skerry::test
