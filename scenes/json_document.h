// A JSON text whose every value knows the line it stands on and its path, so that a mistake can be
// pointed at. Refuses what JSON parsers let through: repeated keys and absurd nesting.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "scenes/scene_error.h"

namespace skerry::scenes {

enum class JsonKind : std::uint8_t { null, boolean, number, string, array, object };

class JsonDocument;

struct JsonNode {
  JsonKind kind = JsonKind::null;
  int line = 0;
  bool boolean = false;
  double number = 0;
  std::string text;                       // of a string; of a number as it is written
  std::vector<const JsonNode*> children;  // elements, or members in the order of the file

  const JsonDocument* document = nullptr;
  const JsonNode* parent = nullptr;
  std::string key;        // within an object
  std::size_t index = 0;  // within an array

  const JsonNode* find(std::string_view member) const;  // null if there is none
  std::string path() const;                             // "bodies[3].shapes[0].radius"
  std::string shown() const;  // the value, for messages: -0.5, "x", a list

  // Throws SceneError about this value: `detail`, with the value where detail says so itself.
  [[noreturn]] void fail(const std::string& detail) const;
  // "must be <rule>, got <value>".
  [[noreturn]] void refuse(const std::string& rule) const;
};

class JsonDocument {
 public:
  // Throws SceneError: not JSON, a number too large for a double, a key twice, nesting over 64.
  JsonDocument(const std::string& text, std::string file_name);
  JsonDocument(const JsonDocument&) = delete;
  JsonDocument& operator=(const JsonDocument&) = delete;

  const JsonNode& root() const { return *root_; }
  const std::string& file_name() const { return file_name_; }

 private:
  friend class JsonBuilder;
  std::string file_name_;
  std::deque<JsonNode> nodes_;  // addresses stay
  const JsonNode* root_ = nullptr;
};

// Says why the path cannot be read as a file.
[[noreturn]] void fail_no_file(const std::filesystem::path& path);

// The text of a file. Throws SceneError if it cannot be read or is larger than 256 MB.
std::string read_text_file(const std::filesystem::path& path);

}  // namespace skerry::scenes
