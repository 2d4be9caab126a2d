#include "scenes/json_values.h"

#include <charconv>
#include <cmath>

#include "scenes/near_names.h"
#include "scenes/rigid_maths.h"
#include "scenes/scene_format.h"

namespace skerry::scenes {
namespace {

std::string text(double value) {
  std::array<char, 32> buffer = {};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

const std::vector<const JsonNode*>& three(const JsonNode& node, const char* of) {
  if (node.kind != JsonKind::array || node.children.size() != 3) {
    node.refuse(std::string("a list of three ") + of);
  }
  return node.children;
}

template <class Read>
Vec3 one_or_three(const JsonNode& node, Read&& read) {
  if (node.kind == JsonKind::number) return Vec3::Constant(read(node));
  if (node.kind != JsonKind::array || node.children.size() != 3) {
    node.refuse("a number or a list of three numbers");
  }
  return {read(*node.children[0]), read(*node.children[1]), read(*node.children[2])};
}

double radians(double degrees) { return degrees * kRadiansPerDegree; }

Quat read_quaternion(const JsonNode& node) {
  if (node.children.size() != 4) node.refuse("a list x, y, z, w or an object");
  std::array<double, 4> q = {};
  for (std::size_t i = 0; i < 4; ++i) q[i] = read_number(*node.children[i]);
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(norm - 1) < 1e-3))
    node.fail("must be a unit quaternion, got length " + text(norm));
  return normalized(q[0], q[1], q[2], q[3]);
}

}  // namespace

double read_number(const JsonNode& node) {
  if (node.kind != JsonKind::number) node.refuse("a number");
  return node.number;
}

double read_positive(const JsonNode& node) {
  if (!(read_number(node) > 0)) node.refuse("positive");
  return node.number;
}

double read_not_negative(const JsonNode& node) {
  if (!(read_number(node) >= 0)) node.refuse("zero or more");
  return node.number;
}

double read_within(const JsonNode& node, double low, double high) {
  const double value = read_number(node);
  if (!(value >= low && value <= high)) {
    node.refuse("between " + text(low) + " and " + text(high));
  }
  return value;
}

std::int64_t read_integer(const JsonNode& node, std::int64_t low, std::int64_t high) {
  const double value = read_number(node);
  const bool whole = value == std::floor(value);
  if (!whole || value < static_cast<double>(low) || value > static_cast<double>(high)) {
    node.refuse("a whole number between " + std::to_string(low) + " and " + std::to_string(high));
  }
  return static_cast<std::int64_t>(value);
}

bool read_bool(const JsonNode& node) {
  if (node.kind != JsonKind::boolean) node.refuse("true or false");
  return node.boolean;
}

const std::string& read_string(const JsonNode& node) {
  if (node.kind != JsonKind::string) node.refuse("a string");
  return node.text;
}

const std::string& read_name(const JsonNode& node) {
  const std::string& name = read_string(node);
  bool clean = !name.empty();
  for (const char c : name) clean = clean && static_cast<unsigned char>(c) >= 0x20;
  if (!clean) node.refuse("a name");
  return name;
}

Vec3 read_vec3(const JsonNode& node) {
  const auto& list = three(node, "numbers");
  return {read_number(*list[0]), read_number(*list[1]), read_number(*list[2])};
}

Vec3 read_positive3(const JsonNode& node) {
  const auto& list = three(node, "numbers");
  return {read_positive(*list[0]), read_positive(*list[1]), read_positive(*list[2])};
}

Vec3 read_scale(const JsonNode& node) { return one_or_three(node, read_positive); }
Vec3 read_amplitude(const JsonNode& node) { return one_or_three(node, read_not_negative); }

Vec3 read_direction(const JsonNode& node) {
  const Vec3 v = read_vec3(node);
  const double length = std::sqrt(v.x() * v.x() + v.y() * v.y() + v.z() * v.z());
  if (!(length > 0 && std::isfinite(length))) node.fail("must not be of length " + text(length));
  return {v.x() / length, v.y() / length, v.z() / length};
}

std::array<bool, 3> read_bool3(const JsonNode& node) {
  const auto& list = three(node, "true or false");
  return {read_bool(*list[0]), read_bool(*list[1]), read_bool(*list[2])};
}

Quat read_orientation(const JsonNode& node) {
  if (node.kind == JsonKind::array) return read_quaternion(node);
  if (node.find("axis") || node.find("degrees")) {
    check_object(node, "axis_angle");
    return axis_angle(read_direction(*node.find("axis")),
                      radians(read_within(*node.find("degrees"), -1e6, 1e6)));
  }
  check_object(node, "euler");
  const JsonNode& euler = *node.find("euler_degrees");
  const auto& list = three(euler, "numbers");
  Vec3 angles;
  for (int i = 0; i < 3; ++i)
    angles[i] = radians(read_within(*list[static_cast<std::size_t>(i)], -1e6, 1e6));
  return euler_xyz(angles);
}

const std::vector<const JsonNode*>& read_list(const JsonNode& node, std::size_t least) {
  if (node.kind != JsonKind::array) node.refuse("a list");
  if (node.children.size() < least) {
    node.fail("needs at least " + std::to_string(least) + (least == 1 ? " entry" : " entries") +
              ", has " + std::to_string(node.children.size()));
  }
  return node.children;
}

std::size_t read_choice(const JsonNode& node, std::span<const std::string_view> choices) {
  const std::string& name = read_string(node);
  std::string all;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == name) return i;
    all += (all.empty() ? "" : ", ") + std::string(choices[i]);
  }
  const std::vector<std::string> known(choices.begin(), choices.end());
  node.fail("must be one of " + all + ", got " + node.shown() + did_you_mean(name, known));
}

}  // namespace skerry::scenes
