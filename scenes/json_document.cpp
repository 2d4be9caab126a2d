#include "scenes/json_document.h"

#include <cstddef>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

namespace skerry::scenes {
namespace {

constexpr std::size_t kMaxDepth = 64;
constexpr std::size_t kMaxMembers = 10000;  // of one object: looked up one by one
constexpr std::uintmax_t kMaxFileSize = std::uintmax_t{256} << 20;

// The parser reads one character past a number, so the line that counts is that of the last
// character that is not white space.
struct LineCounter {
  int line = 1;
  int token_line = 1;

  void pass(char c) {
    if (c == '\n') {
      ++line;
    } else if (c != ' ' && c != '\t' && c != '\r') {
      token_line = line;
    }
  }
};

class CountingIterator {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  CountingIterator(const char* at, LineCounter* counter) : at_(at), counter_(counter) {}
  reference operator*() const { return *at_; }
  CountingIterator& operator++() {
    counter_->pass(*at_++);
    return *this;
  }
  CountingIterator operator++(int) {
    const CountingIterator before = *this;
    ++*this;
    return before;
  }
  bool operator==(const CountingIterator& other) const { return at_ == other.at_; }

 private:
  const char* at_;
  LineCounter* counter_;
};

std::string shortened(const std::string& text) {
  constexpr std::size_t kShown = 40;
  return text.size() <= kShown ? text : text.substr(0, kShown) + "...";
}

// The library's sentence without its own numbering ("[json.exception.parse_error.101] parse error
// at line 1, column 2: ").
std::string without_preamble(const std::string& what) {
  const auto at = what.find(": ");
  return at == std::string::npos ? what : what.substr(at + 2);
}

}  // namespace

// Receives the parser's events and hangs nodes into the document.
class JsonBuilder {
 public:
  JsonBuilder(JsonDocument& document, const LineCounter& counter)
      : document_(document), counter_(counter) {}

  bool null() { return add(JsonKind::null), true; }
  bool boolean(bool value) {
    add(JsonKind::boolean).boolean = value;
    return true;
  }
  bool number_integer(std::int64_t value) {
    return add_number(static_cast<double>(value), std::to_string(value));
  }
  bool number_unsigned(std::uint64_t value) {
    return add_number(static_cast<double>(value), std::to_string(value));
  }
  bool number_float(double value, const std::string& text) { return add_number(value, text); }
  bool string(std::string& value) {
    add(JsonKind::string).text = std::move(value);
    return true;
  }
  bool binary(std::vector<std::uint8_t>&) { return false; }  // never comes from text

  bool start_object(std::size_t) { return open(JsonKind::object); }
  bool start_array(std::size_t) { return open(JsonKind::array); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }
  bool key(std::string& name) {
    if (open_.back()->find(name)) {
      fail(child_path(*open_.back(), name), "is given twice");
    }
    if (open_.back()->children.size() == kMaxMembers)
      fail(open_.back()->path(), "too many members");
    key_ = std::move(name);
    return true;
  }

  bool parse_error(std::size_t, const std::string& token, const nlohmann::json::exception& error) {
    if (error.id == 406) {  // number overflow
      fail(open_.empty() ? "" : child_path(*open_.back(), key_),
           "must be a finite number, got " + shortened(token));
    }
    fail("", "not valid JSON: " + without_preamble(error.what()));
  }

 private:
  static std::string child_path(const JsonNode& parent, const std::string& key) {
    JsonNode child;
    child.parent = &parent;
    child.key = key;
    child.index = parent.children.size();
    return child.path();
  }

  [[noreturn]] void fail(const std::string& path, const std::string& detail) const {
    throw SceneError(document_.file_name_, counter_.token_line, path, detail);
  }

  JsonNode& add(JsonKind kind) {
    JsonNode& node = document_.nodes_.emplace_back();
    node.kind = kind;
    node.line = counter_.token_line;
    node.document = &document_;
    if (open_.empty()) {
      document_.root_ = &node;
      return node;
    }
    JsonNode& parent = *open_.back();
    node.parent = &parent;
    if (parent.kind == JsonKind::object) node.key = std::move(key_);
    node.index = parent.children.size();
    parent.children.push_back(&node);
    return node;
  }

  bool add_number(double value, const std::string& text) {
    JsonNode& node = add(JsonKind::number);
    node.number = value;
    node.text = text;
    return true;
  }

  bool open(JsonKind kind) {
    if (open_.size() == kMaxDepth) fail("", "nested more than 64 deep");
    open_.push_back(&add(kind));
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  JsonDocument& document_;
  const LineCounter& counter_;
  std::vector<JsonNode*> open_;
  std::string key_;
};

const JsonNode* JsonNode::find(std::string_view member) const {
  for (const JsonNode* child : children) {
    if (kind == JsonKind::object && child->key == member) return child;
  }
  return nullptr;
}

std::string JsonNode::path() const {
  if (!parent) return "";
  if (parent->kind == JsonKind::array) return parent->path() + '[' + std::to_string(index) + ']';
  const std::string before = parent->path();
  return before.empty() ? key : before + '.' + key;
}

std::string JsonNode::shown() const {
  switch (kind) {
    case JsonKind::null:
      return "null";
    case JsonKind::boolean:
      return boolean ? "true" : "false";
    case JsonKind::number:
      return text;
    case JsonKind::string:
      return '"' + shortened(text) + '"';
    case JsonKind::array:
      return "a list of " + std::to_string(children.size());
    case JsonKind::object:
      return "an object";
  }
  return "";
}

void JsonNode::fail(const std::string& detail) const {
  throw SceneError(document->file_name(), line, path(), detail);
}

void JsonNode::refuse(const std::string& rule) const {
  fail("must be " + rule + ", got " + shown());
}

JsonDocument::JsonDocument(const std::string& text, std::string file_name)
    : file_name_(std::move(file_name)) {
  LineCounter counter;
  JsonBuilder builder(*this, counter);
  const char* begin = text.data();
  nlohmann::json::sax_parse(CountingIterator(begin, &counter),
                            CountingIterator(begin + text.size(), &counter), &builder);
}

void fail_no_file(const std::filesystem::path& path) {
  std::error_code error;
  const bool exists = std::filesystem::exists(path, error);
  throw SceneError(path.empty() ? "''" : path.string(), 0, "",
                   exists ? "is not a regular file" : "no such file");
}

std::string read_text_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) fail_no_file(path);
  if (std::filesystem::file_size(path, error) > kMaxFileSize) {
    throw SceneError(path.string(), 0, "", "larger than 256 MB");
  }
  std::ifstream input(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(input)), std::istreambuf_iterator<char>());
  if (!input) throw SceneError(path.string(), 0, "", "cannot be read");
  return text;
}

}  // namespace skerry::scenes
