#include "tests/scenes/cases.h"

namespace skerry::test {

std::string scene_with(const std::string& contents) {
  return "{ \"format\": \"skerry-scene\", \"version\": 1,\n" + contents + "\n}\n";
}

namespace {

// One body, whose members begin on line 3.
std::string body_with(const std::string& members) {
  return scene_with("\"bodies\": [\n{ " + members + " }\n]");
}

std::string shape_with(const std::string& members) {
  return body_with("\"shapes\": [\n{ " + members + " } ]");
}

constexpr const char* kBall = R"("shapes": [{ "type": "sphere", "radius": 1 }])";

std::string named_balls(const std::string& more) {
  return scene_with(std::string("\"bodies\": [ { \"name\": \"a\", ") + kBall +
                    " }, { \"name\": \"b\", \"position\": [3, 0, 0], " + kBall + " } ],\n" + more);
}

std::string nested(int depth) { return std::string(depth, '[') + std::string(depth, ']'); }

// -- By kind of mistake -----------------------------------------------------------------------------

std::vector<WrongScene> wrong_texts() {
  return {
      {"empty", "",
       ":1: not valid JSON: syntax error while parsing value - unexpected end of "
       "input; expected '[', '{', or a literal",
       false},
      {"truncated", "{ \"format\": \"skerry-scene\",\n\"version\": 1,\n",
       ":2: not valid JSON: syntax error while parsing object key - unexpected end of input; "
       "expected string literal",
       false},
      {"not_an_object", "[1]", ":1: must be an object, got a list of 1", true},
      {"no_format", "{}",
       ":1: \"format\" is missing; a scene file begins with \"format\": \"skerry-scene\"", true},
      {"other_format", "{\"format\": \"gltf\"}",
       ":1: format: must be \"skerry-scene\", got \"gltf\"", true},
      {"no_version", "{\"format\": \"skerry-scene\"}", ":1: \"version\" is missing", true},
      {"other_version", "{\"format\": \"skerry-scene\",\n\"version\": 2}",
       ":2: version: must be 1, the only version there is, got 2", true},
      {"unknown_field", scene_with("\"gravty\": [0, -10, 0]"),
       ":2: gravty: unknown field (did you mean \"gravity\"?)", true},
      {"given_twice", scene_with("\"steps\": 1,\n\"steps\": 2"), ":3: steps: is given twice",
       false},
      {"too_deep", scene_with("\"bodies\": " + nested(100)), ":2: nested more than 64 deep", true},
      {"overflow", body_with("\"position\": [0, 1e999, 0]"),
       ":3: bodies[0].position[1]: must be a finite number, got 1e999", false},
  };
}

std::vector<WrongScene> wrong_values() {
  return {
      {"gravity_size", scene_with("\"gravity\": [0, -10]"),
       ":2: gravity: must be a list of three numbers, got a list of 2", true},
      {"gravity_type", scene_with("\"gravity\": [0, \"down\", 0]"),
       ":2: gravity[1]: must be a number, got \"down\"", true},
      {"dt_zero", scene_with("\"dt\": 0"), ":2: dt: must be positive, got 0", true},
      {"dt_large", scene_with("\"dt\": 1.5"), ":2: dt: must be between 1e-6 and 1 s, got 1.5",
       true},
      {"dt_tiny", scene_with("\"dt\": 1e-9"), ":2: dt: must be between 1e-6 and 1 s, got 1e-9",
       true},
      {"solver", scene_with("\"solver\": \"magic\""),
       ":2: solver: must be one of soft_step_tgs, pgs, penalty, got \"magic\"", true},
      {"substeps", scene_with("\"substeps\": 0"),
       ":2: substeps: must be a whole number between 1 and 64, got 0", true},
      {"steps_fraction", scene_with("\"steps\": 2.5"),
       ":2: steps: must be a whole number between 0 and 1000000000, got 2.5", true},
      {"sleep", scene_with("\"sleep\": 1"), ":2: sleep: must be true, false or an object, got 1",
       true},
      {"radius", shape_with(R"("type": "sphere", "radius": -0.5)"),
       ":4: bodies[0].shapes[0].radius: must be positive, got -0.5", true},
      {"radius_missing", shape_with(R"("type": "sphere")"),
       ":4: bodies[0].shapes[0]: \"radius\" is missing", true},
      {"shape_type", shape_with(R"("type": "spere", "radius": 1)"),
       ":4: bodies[0].shapes[0].type: must be one of sphere, capsule, box, cylinder, cone, "
       "ellipsoid, convex_hull, plane, mesh, height_field, got \"spere\" (did you mean "
       "\"sphere\"?)",
       true},
      {"shape_field", shape_with(R"("type": "box", "extents": [1, 1, 1])"),
       ":4: bodies[0].shapes[0].extents: unknown field (did you mean \"half_extents\"?)", true},
      {"box_flat", shape_with(R"("type": "box", "half_extents": [1, 0, 1])"),
       ":4: bodies[0].shapes[0].half_extents[1]: must be positive, got 0", true},
      {"hull_small", shape_with(R"("type": "convex_hull", "points": [[0,0,0],[1,0,0],[0,1,0]])"),
       ":4: bodies[0].shapes[0].points: needs at least 4 entries, has 3", true},
      {"hull_without_points", shape_with(R"("type": "convex_hull")"),
       ":4: bodies[0].shapes[0]: needs either \"points\" or \"mesh\"", false},
      {"heights_few", shape_with(R"("type": "height_field", "heights": [[0, 1]])"),
       ":4: bodies[0].shapes[0].heights: needs at least 2 entries, has 1", true},
      {"heights_ragged", shape_with(R"("type": "height_field", "heights": [[0, 1], [0, 1, 2]])"),
       ":4: bodies[0].shapes[0].heights[1]: must be as long as the first row (2), got a list of 3",
       false},
      {"hole_outside",
       shape_with(R"("type": "height_field", "heights": [[0, 1], [0, 1]], "holes": [[0, 1]])"),
       ":4: bodies[0].shapes[0].holes[0][1]: must be a whole number between 0 and 0, got 1", false},
      {"friction", body_with(std::string(kBall) + ", \"friction\": -1"),
       ":3: bodies[0].friction: must be zero or more, got -1", true},
      {"restitution", body_with(std::string(kBall) + ", \"restitution\": 1.5"),
       ":3: bodies[0].restitution: must be between 0 and 1, got 1.5", true},
      {"quaternion", body_with(std::string(kBall) + ", \"orientation\": [0, 0, 0, 2]"),
       ":3: bodies[0].orientation: must be a unit quaternion, got length 2", false},
      {"axis",
       body_with(std::string(kBall) + R"(, "orientation": {"axis": [0, 0, 0], "degrees": 10})"),
       ":3: bodies[0].orientation.axis: must not be of length 0", false},
      {"body_type", body_with(std::string(kBall) + R"(, "type": "static")"),
       ":3: bodies[0].type: must be one of dynamic, fixed, kinematic, got \"static\"", true},
      {"mass", body_with(std::string(kBall) + R"(, "mass": {"mass": 0})"),
       ":3: bodies[0].mass.mass: must be positive, got 0", true},
      {"locks", body_with(std::string(kBall) + R"(, "locks": {"rotation": [true, false]})"),
       ":3: bodies[0].locks.rotation: must be a list of three true or false, got a list of 2",
       true},
      {"mask", shape_with(R"("type": "sphere", "radius": 1, "mask": 4294967296)"),
       ":4: bodies[0].shapes[0].mask: must be a whole number between 0 and 4294967295, got "
       "4294967296",
       true},
  };
}

std::vector<WrongScene> wrong_settings() {
  return {
      {"solver_field", scene_with("\"solver\": {\"hertz\": 60}"),
       ":2: solver.hertz: unknown field (did you mean \"contact_hertz\"?)", true},
      {"solver_kind", scene_with("\"solver\": {\"kind\": \"pg\"}"),
       ":2: solver.kind: must be one of soft_step_tgs, pgs, penalty, got \"pg\" (did you mean "
       "\"pgs\"?)",
       true},
      {"contact_hertz", scene_with("\"solver\": {\"contact_hertz\": 0}"),
       ":2: solver.contact_hertz: must be positive, got 0", true},
      {"restitution_threshold", scene_with("\"solver\": {\"restitution_threshold\": -1}"),
       ":2: solver.restitution_threshold: must be zero or more, got -1", true},
      {"pgs_iterations", scene_with("\"solver\": {\"pgs\": {\"iterations\": 0}}"),
       ":2: solver.pgs.iterations: must be a whole number between 1 and 10000, got 0", true},
      {"penalty_hertz", scene_with("\"solver\": {\"penalty\": {\"hertz\": -60}}"),
       ":2: solver.penalty.hertz: must be positive, got -60", true},
      {"gravity_beyond_the_engine", scene_with("\"gravity\": [0, 1e30, 0]"),
       ":2: gravity: must be finite and at most 1e9 per second in each axis, got (0, 1e+30, 0)",
       false},
      {"damping_beyond_the_solver", scene_with("\"solver\": {\n\"contact_damping_ratio\": 1e9 }"),
       ":3: solver.contact_damping_ratio: must be between 0 and 1e6, got 1e+09", false},
      {"sleep_time", scene_with("\"sleep\": {\"time\": 0}"),
       ":2: sleep.time: must be positive, got 0", true},
      {"integrator", scene_with("\"integrator\": \"euler\""),
       ":2: integrator: must be one of explicit_euler, semi_implicit_euler, velocity_verlet, rk4, "
       "exact, got \"euler\" (did you mean \"explicit_euler\"?)",
       true},
      {"broadphase", scene_with("\"broadphase\": \"grid\""),
       ":2: broadphase: must be one of tree, sweep_and_prune, fcl, got \"grid\"", true},
      {"hit_speed", scene_with("\"hit_speed\": -1"), ":2: hit_speed: must be zero or more, got -1",
       true},
      {"swept", body_with(std::string(kBall) + R"(, "continuous": true)"),
       ":3: bodies[0].continuous: must be a string, got true", true},
  };
}

std::vector<WrongScene> wrong_names() {
  return {
      {"material", body_with(std::string(kBall) + R"(, "material": "rubber")"),
       ":3: bodies[0].material: unknown material \"rubber\"", false},
      {"material_slip",
       scene_with(R"("materials": {"rubber": {}}, "bodies": [{"shapes": [], "mass": 1, )"
                  R"("material": "ruber"}])"),
       ":2: bodies[0].material: unknown material \"ruber\" (did you mean \"rubber\"?)", false},
      {"mesh", shape_with(R"("type": "mesh", "mesh": "hill")"),
       ":4: bodies[0].shapes[0].mesh: unknown mesh \"hill\"", false},
      {"mesh_file_missing", scene_with(R"("meshes": {"hill": {"file": "nowhere.obj"}})"),
       ":2: meshes.hill.file: mesh file \"nowhere.obj\": no such file", false},
      {"mesh_file_absolute", scene_with(R"("meshes": {"hill": {"file": "/hill.obj"}})"),
       ":2: meshes.hill.file: must be a path relative to the scene file, got \"/hill.obj\"", false},
      {"prefab", scene_with(R"("bodies": [{"prefab": "car"}])"),
       ":2: bodies[0].prefab: unknown prefab \"car\"", false},
      {"same_name",
       scene_with(std::string("\"bodies\": [ { \"name\": \"a\", ") + kBall +
                  " },\n{ \"name\": \"a\", " + kBall + " } ]"),
       ":3: bodies[1].name: the name \"a\" is used twice", false},
      {"prefab_in_itself",
       scene_with("\"prefabs\": { \"a\": { \"bodies\": [ { \"prefab\": \"b\" } ] },\n"
                  "\"b\": { \"bodies\": [ { \"prefab\": \"a\" } ] } },\n"
                  "\"bodies\": [ { \"prefab\": \"a\" } ]"),
       ":3: prefabs.b.bodies[0].prefab: prefab \"a\" contains itself (a -> b -> a)", false},
      {"unused_prefab_in_itself",
       scene_with("\"prefabs\": { \"a\": { \"bodies\": [ { \"prefab\": \"a\" } ] } }"),
       ":2: prefabs.a.bodies[0].prefab: prefab \"a\" contains itself (a -> a)", false},
      {"field_type", scene_with(R"("force_fields": [{"type": "wnd"}])"),
       ":2: force_fields[0].type: must be one of uniform, drag, attractor, spring, wind, got "
       "\"wnd\" (did you mean \"wind\"?)",
       true},
      {"field_body", named_balls(R"("force_fields": [{"type": "drag", "bodies": ["c"]}])"),
       ":3: force_fields[0].bodies[0]: unknown body \"c\" (did you mean \"a\"?)", false},
  };
}

std::vector<WrongScene> wrong_repeaters_and_events() {
  const std::string ball = std::string("[{ ") + kBall + " }]";
  return {
      {"grid_count",
       scene_with(R"("bodies": [{"grid": {"count": [2, 0, 2], "spacing": 1}, "of": )" + ball +
                  "}]"),
       ":2: bodies[0].grid.count[1]: must be a whole number between 1 and 1000000, got 0", true},
      {"grid_of_nothing",
       scene_with(R"("bodies": [{"grid": {"count": [2, 1, 2], "spacing": 1}, "of": []}])"),
       ":2: bodies[0].of: needs at least 1 entry, has 0", true},
      {"grid_too_large",
       scene_with(R"("bodies": [{"grid": {"count": [1000, 1000, 2], "spacing": 3}, "of": )" + ball +
                  "}]"),
       ":2: bodies[0].grid.count: the scene has more than 1000000 bodies", false},
      {"pile_columns",
       scene_with(R"("bodies": [{"pile": {"count": 9, "columns": [3], "spacing": 1}, "of": )" +
                  ball + "}]"),
       ":2: bodies[0].pile.columns: needs at least 2 entries, has 1", true},
      {"event_without_action", scene_with(R"("events": [{"step": 3}])"),
       ":2: events[0]: needs one of \"impulse\", \"spawn\" and \"remove\"", true},
      {"event_step_zero", named_balls(R"("events": [{"step": 0, "remove": {"body": "a"}}])"),
       ":3: events[0].step: must be a whole number between 1 and 1000000000, got 0", true},
      {"event_body", named_balls(R"("events": [{"step": 1, "remove": {"body": "c"}}])"),
       ":3: events[0].remove.body: unknown body \"c\" (did you mean \"a\"?)", false},
      {"event_after_removal",
       named_balls("\"events\": [{\"step\": 9, \"impulse\": {\"body\": \"a\", \"impulse\": [1, 0, "
                   "0]}},\n{\"step\": 5, \"remove\": {\"body\": \"a\"}}]"),
       ":3: events[0].impulse.body: \"a\" was removed at step 5", false},
      {"event_before_spawn",
       scene_with(std::string(R"("events": [{"step": 5, "spawn": {"name": "late", )") + kBall +
                  "}},\n{\"step\": 4, \"remove\": {\"body\": \"late\"}}]"),
       ":3: events[1].remove.body: unknown body \"late\"", false},
      {"impulse_on_fixed",
       scene_with(std::string(R"("bodies": [{"name": "wall", "type": "fixed", )") + kBall +
                  "}],\n\"events\": [{\"step\": 1, \"impulse\": {\"body\": \"wall\", \"impulse\": "
                  "[1, 0, 0]}}]"),
       ":3: events[0].impulse.body: \"wall\" is not dynamic: an impulse does nothing to it", false},
  };
}

void append(std::vector<WrongScene>& to, std::vector<WrongScene> more) {
  for (WrongScene& scene : more) to.push_back(std::move(scene));
}

}  // namespace

std::vector<WrongScene> wrong_scenes() {
  std::vector<WrongScene> all = wrong_texts();
  append(all, wrong_values());
  append(all, wrong_settings());
  append(all, wrong_names());
  append(all, wrong_joints());
  append(all, wrong_repeaters_and_events());
  return all;
}

std::string full_scene() {
  return R"({
  "$schema": "scene.schema.json", "format": "skerry-scene", "version": 1, "name": "full",
  "description": "Every field", "gravity": [0, -9.81, 0], "dt": 0.02, "substeps": 6, "steps": 50,
  "solver": { "kind": "pgs", "contact_hertz": 90, "contact_damping_ratio": 5, "max_push_velocity": 2, "restitution_threshold": 0.5, "joint_hertz": 50, "joint_damping_ratio": 1.5,
    "pgs": { "iterations": 20, "correction": "baumgarte", "correction_rate": 0.1, "slop": 0.002 }, "penalty": { "substeps": 16, "hertz": 80 } },
  "warmup": 5, "sleep": { "enabled": false, "linear_threshold": 0.1, "angular_threshold": 0.2, "time": 1 }, "seed": 99,
  "integrator": "rk4", "broadphase": "sweep_and_prune", "continuous": false, "persist_events": true, "hit_speed": 2, "measure": true,
  "materials": { "steel": { "friction": 0.3, "restitution": 0.2, "rolling_resistance": 0.001, "density": 7800 } },
  "meshes": { "block": { "file": "block.obj", "scale": [2, 1, 2], "weld": 1e-6, "manifold": true } },
  "prefabs": {
    "pair": {
      "bodies": [
        { "name": "left", "position": [-1, 0, 0], "shapes": [{ "type": "sphere", "radius": 0.3, "hollow": true, "density": 5 }] },
        { "name": "right", "position": [1, 0, 0], "shapes": [{ "type": "capsule", "radius": 0.2, "half_height": 0.3 }] }
      ],
      "joints": [{ "type": "ball", "a": "left", "b": "right", "anchor": [0, 0, 0], "collide": true }]
    }
  },
  "bodies": [
    { "name": "ground", "type": "fixed", "shapes": [{ "type": "plane", "normal": [0, 2, 0], "offset": -1 }, { "type": "mesh", "mesh": "block", "scale": 1 }, { "type": "height_field", "heights": [[0, 0.5, 0], [0, 0, 0.25]], "holes": [[1, 0]], "scale": [2, 1, 2] }] },
    {
      "name": "thing", "type": "dynamic", "position": [0, 5, 0], "orientation": { "axis": [0, 1, 0], "degrees": 90 },
      "linear_velocity": [1, 0, 0], "angular_velocity": [0, 1, 0], "density": 500, "material": "steel",
      "friction": 0.4, "restitution": 0.1, "rolling_resistance": 0.01,
      "mass": { "mass": 10, "center": [0, 0.1, 0], "inertia": [1, 1, 1] }, "gravity_scale": 0.5,
      "linear_damping": 0.1, "angular_damping": 0.2, "locks": { "translation": [false, false, true], "rotation": [true, false, false] },
      "allow_sleep": false, "awake": true, "continuous": "never", "user_data": 77,
      "shapes": [
        { "type": "box", "half_extents": [0.5, 0.5, 0.5], "position": [0, 0.5, 0], "orientation": [0, 0, 0, 1],
          "category": 2, "mask": 255, "group": -3, "sensor": false, "material": "steel", "density": 100, "friction": 0.9, "restitution": 0, "rolling_resistance": 0 },
        { "type": "cylinder", "radius": 0.3, "half_height": 0.2, "sensor": true },
        { "type": "cone", "radius": 0.3, "half_height": 0.2 },
        { "type": "ellipsoid", "semi_axes": [0.3, 0.2, 0.1] },
        { "type": "convex_hull", "points": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "scale": 0.5 },
        { "type": "convex_hull", "mesh": "block" }
      ]
    },
    { "name": "heavy", "position": [4, 5, 0], "orientation": { "euler_degrees": [10, 20, 30] }, "mass": 3,
      "shapes": [{ "type": "sphere", "radius": 0.5 }] },
    { "name": "p", "prefab": "pair", "position": [0, 9, 0], "orientation": [0, 0, 0, 1] },
    { "name": "g", "position": [20, 1, 0], "orientation": [0, 0, 0, 1], "grid": { "count": [2, 2, 2], "spacing": [1.5, 1.5, 1.5], "jitter": 0.01, "seed": 1 },
      "of": [{ "shapes": [{ "type": "sphere", "radius": 0.5 }] }, { "name": "q", "prefab": "pair" }] },
    { "name": "s", "position": [-20, 1, 0], "orientation": [0, 0, 0, 1], "stack": { "count": 3, "offset": [0, 1, 0], "turn_degrees": 15, "jitter": [0, 0, 0.01], "seed": 2 },
      "of": [{ "shapes": [{ "type": "box", "half_extents": [0.5, 0.5, 0.5] }] }] },
    { "name": "h", "position": [0, 1, 20], "orientation": [0, 0, 0, 1], "pile": { "count": 10, "columns": [2, 2], "spacing": 1.5, "jitter": 0.1, "turn": false, "seed": 3 },
      "of": [{ "shapes": [{ "type": "sphere", "radius": 0.5 }] }] }
  ],
  "joints": [
    { "type": "hinge", "a": "thing", "b": "heavy", "anchor": [2, 5, 0], "axis": [0, 0, 1], "limits_degrees": [-30, 45], "motor": { "speed": 1, "max_torque": 10 }, "collide": false },
    { "type": "hinge", "b": "thing", "anchor": [0, 6, 0], "axis": [0, 0, 2], "limits_degrees": [null, 90], "limit_frequency": 3, "limit_damping_ratio": 0.5,
      "spring": { "frequency": 1, "damping_ratio": 0.7, "rest_degrees": 30 }, "friction_torque": 2, "breaks": { "force": 5000, "torque": 400 } },
    { "type": "ball", "a": "thing", "b": "s[0]", "anchor": [0, 5, 0], "friction_torque": 3 },
    { "type": "slider", "a": "heavy", "b": "g[0]", "anchor": [4, 5, 0], "axis": [1, 0, 0], "limits": [-1, 2], "limit_frequency": 4, "limit_damping_ratio": 0.6,
      "spring": { "frequency": 2, "damping_ratio": 0.3, "rest": 0.5 }, "motor": { "target": 1, "max_force": 30, "frequency": 5, "damping_ratio": 0.8 }, "friction_force": 6 },
    { "type": "fixed", "a": "heavy", "b": "g[2]", "anchor": [4, 5, 0], "collide": true },
    { "type": "distance", "a": "heavy", "b": "g[4]", "anchor_a": [4, 5, 0], "anchor_b": [5, 5, 0], "limits": [null, 3], "motor": { "speed": -2, "max_force": 9 } },
    { "type": "cone_twist", "a": "heavy", "b": "g[6]", "anchor": [4, 5, 0], "axis": [1, 0, 0], "swing_limit_degrees": 45, "twist_limits_degrees": [-10, 20], "limit_frequency": 6, "limit_damping_ratio": 0.7,
      "swing": { "spring": { "frequency": 1 }, "friction_torque": 4 }, "twist": { "motor": { "target_degrees": 15, "max_torque": 8, "frequency": 3, "damping_ratio": 0.9 } } },
    { "type": "six_dof", "a": "s[1]", "b": "s[2]", "anchor": [-20, 2, 0], "orientation": { "axis": [0, 1, 0], "degrees": 90 },
      "axes": { "x": "free", "y": "locked", "z": { "limits": [0, 1], "limit_frequency": 2 }, "swing_x": { "limits_degrees": [-45, null] }, "swing_y": { "spring": { "frequency": 2 } }, "twist": "free" } }
  ],
  "force_fields": [
    { "type": "uniform", "acceleration": [0, 1, 0], "force": [1, 0, 0], "bodies": ["heavy"] },
    { "type": "drag", "linear": 0.1, "quadratic": 0.01, "bodies": ["heavy"] },
    { "type": "attractor", "point": [0, 0, 0], "strength": 5, "softening": 0.5, "bodies": ["p.left", "g[0]", "g[1].q.left"] },
    { "type": "spring", "anchor": [0, 0, 0], "stiffness": 2, "damping": 0.1, "bodies": ["thing"] },
    { "type": "wind", "velocity": [1, 0, 0], "drag": 0.1, "gust": { "amplitude": 0.5, "period": 2 }, "bodies": ["s[2]"] }
  ],
  "events": [
    { "step": 20, "remove": { "body": "late.right" } },
    { "step": 10, "spawn": { "name": "late", "prefab": "pair", "position": [0, 12, 0] } },
    { "step": 12, "impulse": { "body": "late.left", "impulse": [0, 1, 0], "point": [-1, 12, 0] } }
  ]
})";
}

}  // namespace skerry::test
