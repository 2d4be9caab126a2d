#pragma once

#include <stdexcept>
#include <string>

namespace skerry::scenes {

// What is wrong with a scene file. what() is one line, control characters shown as ?: "tower.json:12: bodies[3].shapes[0].radius:
// must be positive, got -0.5".
class SceneError : public std::runtime_error {
 public:
  // line 0: about the file as a whole; an empty path: about the top level.
  SceneError(std::string file, int line, std::string path, std::string detail);

  const std::string& file() const noexcept { return file_; }
  int line() const noexcept { return line_; }
  const std::string& path() const noexcept { return path_; }
  const std::string& detail() const noexcept { return detail_; }

 private:
  std::string file_;
  int line_;
  std::string path_;
  std::string detail_;
};

}  // namespace skerry::scenes
