#include "scenes/settings_reader.h"

#include "scenes/json_values.h"
#include "scenes/scene_format.h"

namespace skerry::scenes {
namespace {

using Read = double (*)(const JsonNode&);

void set_number(const JsonNode& node, std::string_view field, double& value, Read read) {
  if_given(node, field, [&](const JsonNode& n) { value = read(n); });
}
void set_flag(const JsonNode& node, std::string_view field, bool& value) {
  if_given(node, field, [&](const JsonNode& n) { value = read_bool(n); });
}
void set_passes(const JsonNode& node, std::string_view field, int& value) {
  if_given(node, field,
           [&](const JsonNode& n) { value = static_cast<int>(read_integer(n, 1, 10'000)); });
}
// The value whose name, as to_string() gives it, stands there.
template <class Values, class Enum>
void set_choice(const JsonNode& node, std::string_view field, const Values& values, Enum& value) {
  if_given(node, field, [&](const JsonNode& choice) {
    std::vector<std::string_view> names;
    for (const Enum each : values) names.emplace_back(to_string(each));
    value = values[read_choice(choice, names)];
  });
}

constexpr PositionCorrection kCorrections[] = {PositionCorrection::baumgarte,
                                               PositionCorrection::split_impulse};
constexpr Integrator kIntegrators[] = {Integrator::explicit_euler, Integrator::semi_implicit_euler,
                                       Integrator::velocity_verlet, Integrator::rk4,
                                       Integrator::exact};
constexpr BroadphaseKind kBroadphases[] = {BroadphaseKind::tree, BroadphaseKind::sweep_and_prune,
                                           BroadphaseKind::fcl};

void read_pgs(const JsonNode& node, PgsSettings& pgs) {
  check_object(node, "pgs");
  set_passes(node, "iterations", pgs.iterations);
  set_choice(node, "correction", kCorrections, pgs.correction);
  set_number(node, "correction_rate", pgs.correction_rate, read_not_negative);
  set_number(node, "slop", pgs.slop, read_not_negative);
}

void read_penalty(const JsonNode& node, PenaltySettings& penalty) {
  check_object(node, "penalty");
  set_passes(node, "substeps", penalty.substeps);
  set_number(node, "hertz", penalty.hertz, read_positive);
}

// A name alone or an object.
void read_solver(const JsonNode& root, SolverSettings& solver) {
  const JsonNode& node = *root.find("solver");
  if (node.kind != JsonKind::object) return set_choice(root, "solver", kSolverKinds, solver.kind);
  check_object(node, "solver");
  set_choice(node, "kind", kSolverKinds, solver.kind);
  set_number(node, "contact_hertz", solver.contact_hertz, read_positive);
  set_number(node, "contact_damping_ratio", solver.contact_damping_ratio, read_not_negative);
  set_number(node, "max_push_velocity", solver.max_push_velocity, read_not_negative);
  set_number(node, "restitution_threshold", solver.restitution_threshold, read_not_negative);
  set_number(node, "joint_hertz", solver.joint_hertz, read_positive);
  set_number(node, "joint_damping_ratio", solver.joint_damping_ratio, read_not_negative);
  if_given(node, "pgs", [&](const JsonNode& n) { read_pgs(n, solver.pgs); });
  if_given(node, "penalty", [&](const JsonNode& n) { read_penalty(n, solver.penalty); });
}

// true, false or an object.
void read_sleep(const JsonNode& node, SleepSettings& sleep) {
  if (node.kind == JsonKind::boolean) {
    sleep.enabled = node.boolean;
    return;
  }
  if (node.kind != JsonKind::object) node.refuse("true, false or an object");
  check_object(node, "sleep");
  set_flag(node, "enabled", sleep.enabled);
  set_number(node, "linear_threshold", sleep.linear_threshold, read_not_negative);
  set_number(node, "angular_threshold", sleep.angular_threshold, read_not_negative);
  set_number(node, "time", sleep.time, read_positive);
}

void set_count(const JsonNode& root, std::string_view field, std::uint64_t& value) {
  if_given(root, field, [&](const JsonNode& n) {
    value = static_cast<std::uint64_t>(read_integer(n, 0, 1'000'000'000));
  });
}

}  // namespace

void read_defaults(const JsonNode& root, SceneDefaults& defaults) {
  if_given(root, "gravity", [&](const JsonNode& n) { defaults.gravity = read_vec3(n); });
  if_given(root, "dt", [&](const JsonNode& n) {
    defaults.dt = read_positive(n);
    if (defaults.dt < 1e-6 || defaults.dt > 1) n.refuse("between 1e-6 and 1 s");
  });
  set_count(root, "steps", defaults.steps);
  set_count(root, "warmup", defaults.warmup);
  if (root.find("solver")) read_solver(root, defaults.solver);
  if_given(root, "substeps", [&](const JsonNode& n) {
    defaults.solver.substeps = static_cast<int>(read_integer(n, 1, 64));
  });
  if_given(root, "sleep", [&](const JsonNode& n) { read_sleep(n, defaults.sleep); });
  set_choice(root, "integrator", kIntegrators, defaults.integrator);
  set_choice(root, "broadphase", kBroadphases, defaults.broadphase);
  set_flag(root, "continuous", defaults.continuous);
  set_flag(root, "persist_events", defaults.persist_events);
  set_number(root, "hit_speed", defaults.hit_speed, read_not_negative);
  set_flag(root, "measure", defaults.measure);
}

}  // namespace skerry::scenes
