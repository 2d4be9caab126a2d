#include "scenes/scene_error.h"

#include <utility>

namespace skerry::scenes {
namespace {

// Appends piece by piece: gcc 12 warns falsely about sums that begin with a literal.
std::string sentence(const std::string& file, int line, const std::string& path,
                     const std::string& detail) {
  std::string text = file;
  if (line > 0) text.append(":").append(std::to_string(line));
  text.append(": ");
  if (!path.empty()) text.append(path).append(": ");
  text.append(detail);
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';  // names from the file
  }
  return text;
}

}  // namespace

SceneError::SceneError(std::string file, int line, std::string path, std::string detail)
    : std::runtime_error(sentence(file, line, path, detail)),
      file_(std::move(file)),
      line_(line),
      path_(std::move(path)),
      detail_(std::move(detail)) {}

}  // namespace skerry::scenes
