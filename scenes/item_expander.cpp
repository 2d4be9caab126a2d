#include "scenes/item_expander.h"

#include <algorithm>

#include "scenes/joint_reader.h"
#include "scenes/json_values.h"
#include "scenes/rigid_maths.h"
#include "scenes/scene_format.h"

namespace skerry::scenes {
namespace {

constexpr std::size_t kMaxBodies = 1'000'000;
constexpr std::int64_t kMaxCount = 1'000'000;
void define(Scope& scope, const std::string& name, BodyNumber body, const JsonNode& where) {
  if (!scope.try_emplace(name, body).second) {
    where.fail("the name \"" + name + "\" is used twice");
  }
}

const JsonNode* name_of(const JsonNode& item) {
  const JsonNode* name = item.find("name");
  if (name) read_name(*name);
  return name;
}

BodyDesc placed(BodyDesc body, const Pose& frame) {
  const Pose pose = compose(frame, {body.position, body.orientation});
  body.position = pose.position;
  body.orientation = pose.orientation;
  body.linear_velocity = rotated(frame.orientation, body.linear_velocity);
  body.angular_velocity = rotated(frame.orientation, body.angular_velocity);
  return body;
}

std::size_t read_count(const JsonNode& node) {
  return static_cast<std::size_t>(read_integer(node, 1, kMaxCount));
}

// Draws that a repeater makes for each copy.
struct Jitter {
  explicit Jitter(const JsonNode& repeater) {
    if_given(repeater, "jitter", [&](const JsonNode& n) {
      given = true;
      amplitude = read_amplitude(n);
    });
  }
  Vec3 draw(Lcg& random) const { return given ? random.symmetric3(amplitude) : Vec3::Zero(); }

  bool given = false;
  Vec3 amplitude = Vec3::Zero();
};

double centered(std::size_t i, std::size_t count) {
  return static_cast<double>(i) - static_cast<double>(count - 1) * 0.5;
}

}  // namespace

BodyNumber find_body(const Scope& scope, const JsonNode& name) {
  return look_up(scope, name, "body");
}

void ItemExpander::expand(const JsonNode& list, const Pose& frame, Scope& scope) {
  for (const JsonNode* item : read_list(list, 1)) expand_item(*item, frame, scope);
}

void ItemExpander::expand_item(const JsonNode& item, const Pose& frame, Scope& scope) {
  if (item.kind != JsonKind::object) item.refuse("an object");
  if (item.find("prefab")) return add_instance(item, frame, scope);
  if (item.find("grid")) return add_grid(item, frame, scope);
  if (item.find("stack")) return add_stack(item, frame, scope);
  if (item.find("pile")) return add_pile(item, frame, scope);
  add_body(item, frame, scope);
}

void ItemExpander::check_room(std::size_t more, const JsonNode& where) const {
  if (bodies.size() + more > kMaxBodies) where.fail("the scene has more than 1000000 bodies");
}

void ItemExpander::add_body(const JsonNode& item, const Pose& frame, Scope& scope) {
  const auto [found, fresh] = read_.try_emplace(&item);
  if (fresh) found->second = read_body(item, library_);
  check_room(1, item);
  const auto number = static_cast<BodyNumber>(bodies.size());
  bodies.push_back(placed(found->second, frame));
  body_origins.push_back(&item);
  if (const JsonNode* name = name_of(item)) define(scope, name->text, number, *name);
}

void ItemExpander::add_instance(const JsonNode& item, const Pose& frame, Scope& scope) {
  check_object(item, "instance");
  const JsonNode& prefab = *item.find("prefab");
  look_up(library_.prefabs, prefab, "prefab");
  Scope inside;
  open_prefab(prefab.text, prefab, compose(frame, read_pose(item)), inside);
  if (const JsonNode* name = name_of(item)) {
    for (const auto& [inner, body] : inside) define(scope, name->text + '.' + inner, body, *name);
  }
}

void ItemExpander::open_prefab(const std::string& name, const JsonNode& user, const Pose& frame,
                               Scope& scope) {
  if (std::find(open_.begin(), open_.end(), name) != open_.end()) {
    std::string circle;
    for (const std::string& outer : open_) circle += outer + " -> ";
    user.fail("prefab \"" + name + "\" contains itself (" + circle + name + ")");
  }
  used_.insert(name);
  open_.push_back(name);
  const JsonNode& prefab = *library_.prefabs.at(name);
  check_object(prefab, "prefab");
  expand(*prefab.find("bodies"), frame, scope);
  if_given(prefab, "joints", [&](const JsonNode& list) { join(list, frame, scope); });
  open_.pop_back();
}

void ItemExpander::add_copy(const JsonNode& item, const JsonNode& repeater, std::size_t copy,
                            const Pose& frame, Scope& scope) {
  const std::size_t before = bodies.size();
  Scope inside;
  expand_item(item, frame, inside);
  const JsonNode* name = name_of(repeater);
  if (!name) return;
  const std::string prefix = name->text + '[' + std::to_string(copy) + ']';
  if (inside.empty() && bodies.size() == before + 1) {
    define(scope, prefix, static_cast<BodyNumber>(before), *name);
  }
  for (const auto& [inner, body] : inside) define(scope, prefix + '.' + inner, body, *name);
}

Lcg ItemExpander::random_of(const JsonNode& repeater) const {
  std::uint64_t seed = seed_;
  if_given(repeater, "seed", [&](const JsonNode& n) {
    seed = static_cast<std::uint64_t>(read_integer(n, 0, 0xffffffff));
  });
  return Lcg(seed);
}

void ItemExpander::add_grid(const JsonNode& item, const Pose& frame, Scope& scope) {
  check_object(item, "grid_item");
  const JsonNode& grid = *item.find("grid");
  check_object(grid, "grid");
  const auto& count = read_list(*grid.find("count"), 3);
  if (count.size() != 3) grid.find("count")->refuse("a list of three whole numbers");
  const std::size_t nx = read_count(*count[0]);
  const std::size_t ny = read_count(*count[1]);
  const std::size_t nz = read_count(*count[2]);
  check_room(nx * ny * nz, *grid.find("count"));
  const Vec3 spacing = read_scale(*grid.find("spacing"));
  const Jitter jitter(grid);
  const auto& items = read_list(*item.find("of"), 1);
  const Pose base = compose(frame, read_pose(item));
  Lcg random = random_of(grid);
  std::size_t copy = 0;
  for (std::size_t y = 0; y < ny; ++y) {
    for (std::size_t z = 0; z < nz; ++z) {
      for (std::size_t x = 0; x < nx; ++x, ++copy) {
        const Vec3 at = {centered(x, nx) * spacing.x(), static_cast<double>(y) * spacing.y(),
                         centered(z, nz) * spacing.z()};
        const Pose pose = {at + jitter.draw(random), Quat::Identity()};
        add_copy(*items[copy % items.size()], item, copy, compose(base, pose), scope);
      }
    }
  }
}

void ItemExpander::add_stack(const JsonNode& item, const Pose& frame, Scope& scope) {
  check_object(item, "stack_item");
  const JsonNode& stack = *item.find("stack");
  check_object(stack, "stack");
  const std::size_t count = read_count(*stack.find("count"));
  check_room(count, *stack.find("count"));
  const Vec3 offset = read_vec3(*stack.find("offset"));
  double turn = 0;
  if_given(stack, "turn_degrees",
           [&](const JsonNode& n) { turn = read_within(n, -360, 360) * kRadiansPerDegree; });
  const Jitter jitter(stack);
  const auto& items = read_list(*item.find("of"), 1);
  const Pose base = compose(frame, read_pose(item));
  Lcg random = random_of(stack);
  for (std::size_t k = 0; k < count; ++k) {
    const auto index = static_cast<double>(k);
    const Pose pose = {index * offset + jitter.draw(random), axis_angle({0, 1, 0}, index * turn)};
    add_copy(*items[k % items.size()], item, k, compose(base, pose), scope);
  }
}

void ItemExpander::add_pile(const JsonNode& item, const Pose& frame, Scope& scope) {
  check_object(item, "pile_item");
  const JsonNode& pile = *item.find("pile");
  check_object(pile, "pile");
  const std::size_t count = read_count(*pile.find("count"));
  check_room(count, *pile.find("count"));
  const auto& columns = read_list(*pile.find("columns"), 2);
  if (columns.size() != 2) pile.find("columns")->refuse("a list of two whole numbers");
  const std::size_t nx = read_count(*columns[0]);
  const std::size_t nz = read_count(*columns[1]);
  const double spacing = read_positive(*pile.find("spacing"));
  bool turn = true;
  if_given(pile, "turn", [&](const JsonNode& n) { turn = read_bool(n); });
  const Jitter jitter(pile);
  const auto& items = read_list(*item.find("of"), 1);
  const Pose base = compose(frame, read_pose(item));
  Lcg random = random_of(pile);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t choice =
        items.size() > 1 ? static_cast<std::size_t>(random.unit() * double(items.size())) : 0;
    const Vec3 at = {centered(k % nx, nx) * spacing, double(k / (nx * nz)) * spacing,
                     centered(k / nx % nz, nz) * spacing};
    Pose pose = {at + jitter.draw(random), Quat::Identity()};
    if (turn) pose.orientation = random.orientation();
    add_copy(*items[choice], item, k, compose(base, pose), scope);
  }
}

void ItemExpander::join(const JsonNode& list, const Pose& frame, const Scope& scope) {
  for (const JsonNode* node : read_list(list, 0)) {
    SceneJoint joint = {kWorldFrame, kWorldFrame, read_joint(*node, frame)};
    if_given(*node, "a", [&](const JsonNode& n) { joint.a = find_body(scope, n); });
    if_given(*node, "b", [&](const JsonNode& n) { joint.b = find_body(scope, n); });
    if (joint.a == kWorldFrame && joint.b == kWorldFrame) {
      node->fail("needs \"a\" or \"b\"; what is left out is the world");
    }
    if (joint.a == joint.b) node->find("b")->fail("joins the body to itself");
    joints.push_back(std::move(joint));
    joint_origins.push_back(node);
  }
}

void ItemExpander::check_unused_prefabs() {
  const std::size_t body_count = bodies.size();
  const std::size_t joint_count = joints.size();
  for (const auto& [name, node] : library_.prefabs) {
    if (used_.contains(name)) continue;
    Scope inside;
    open_prefab(name, *node, {}, inside);
    bodies.resize(body_count);
    body_origins.resize(body_count);
    joints.erase(joints.begin() + static_cast<std::ptrdiff_t>(joint_count), joints.end());
    joint_origins.resize(joint_count);
  }
}

}  // namespace skerry::scenes
