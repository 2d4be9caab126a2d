#include "scenes/body_reader.h"

#include <cmath>
#include <limits>

#include "scenes/json_values.h"
#include "scenes/near_names.h"
#include "scenes/scene_format.h"

namespace skerry::scenes {
namespace {

void read_surface(const JsonNode& node, Material& surface) {
  if_given(node, "friction", [&](const JsonNode& n) { surface.friction = read_not_negative(n); });
  if_given(node, "restitution",
           [&](const JsonNode& n) { surface.restitution = read_within(n, 0, 1); });
  if_given(node, "rolling_resistance",
           [&](const JsonNode& n) { surface.rolling_resistance = read_not_negative(n); });
}

bool names_a_surface(const JsonNode& node) {
  return node.find("material") || node.find("friction") || node.find("restitution") ||
         node.find("rolling_resistance");
}

// The named material if there is one, then the single values.
SceneMaterial read_matter(const JsonNode& node, const SceneLibrary& library, SceneMaterial base) {
  if_given(node, "material",
           [&](const JsonNode& n) { base = look_up(library.materials, n, "material"); });
  read_surface(node, base.surface);
  if_given(node, "density", [&](const JsonNode& n) { base.density = read_positive(n); });
  return base;
}

// -- Geometry ---------------------------------------------------------------------------------------

ConvexHull read_hull(const JsonNode& node, const SceneLibrary& library) {
  const JsonNode* points = node.find("points");
  const JsonNode* mesh = node.find("mesh");
  if (!points == !mesh) node.fail("needs either \"points\" or \"mesh\"");
  ConvexHull hull;
  if (mesh) {
    hull.points = look_up(library.meshes, *mesh, "mesh")->vertices;
  } else {
    for (const JsonNode* point : read_list(*points, 4)) hull.points.push_back(read_vec3(*point));
  }
  if_given(node, "scale", [&](const JsonNode& n) { hull.scale = read_scale(n); });
  return hull;
}

Plane read_plane(const JsonNode& node) {
  Plane plane;
  if_given(node, "normal", [&](const JsonNode& n) { plane.normal = read_direction(n); });
  if_given(node, "offset", [&](const JsonNode& n) { plane.offset = read_number(n); });
  return plane;
}

TriangleMesh read_mesh_shape(const JsonNode& node, const SceneLibrary& library) {
  TriangleMesh mesh = {look_up(library.meshes, *node.find("mesh"), "mesh")};
  if_given(node, "scale", [&](const JsonNode& n) { mesh.scale = read_scale(n); });
  return mesh;
}

void read_holes(const JsonNode& node, HeightFieldData& field) {
  const std::uint32_t columns = field.columns - 1, rows = field.rows - 1;
  field.holes.assign(std::size_t{columns} * rows, 0);
  for (const JsonNode* cell : read_list(node, 0)) {
    const auto& place = read_list(*cell, 2);
    if (place.size() != 2) cell->refuse("a list of two: column and row of a cell");
    const auto column = static_cast<std::size_t>(read_integer(*place[0], 0, columns - 1));
    const auto row = static_cast<std::size_t>(read_integer(*place[1], 0, rows - 1));
    field.holes[row * columns + column] = 1;
  }
}

HeightField read_height_field(const JsonNode& node) {
  auto field = std::make_shared<HeightFieldData>();
  const auto& rows = read_list(*node.find("heights"), 2);
  field->rows = static_cast<std::uint32_t>(rows.size());
  field->columns = static_cast<std::uint32_t>(read_list(*rows[0], 2).size());
  for (const JsonNode* row : rows) {
    const auto& heights = read_list(*row, 2);
    if (heights.size() != field->columns)
      row->refuse("as long as the first row (" + std::to_string(field->columns) + ")");
    for (const JsonNode* height : heights)
      field->heights.push_back(static_cast<float>(read_within(*height, -1e7, 1e7)));
  }
  if_given(node, "holes", [&](const JsonNode& n) { read_holes(n, *field); });
  HeightField shape{std::move(field)};
  if_given(node, "scale", [&](const JsonNode& n) { shape.scale = read_scale(n); });
  return shape;
}

ShapeGeometry read_sphere(const JsonNode& node, const SceneLibrary&) {
  Sphere sphere = {read_positive(*node.find("radius"))};
  if_given(node, "hollow", [&](const JsonNode& n) { sphere.hollow = read_bool(n); });
  return sphere;
}

template <class Round>
ShapeGeometry read_round(const JsonNode& node, const SceneLibrary&) {
  return Round{read_positive(*node.find("radius")), read_positive(*node.find("half_height"))};
}

struct ShapeKind {
  std::string_view type;  // in the file
  std::string_view spec;  // ObjectSpec
  ShapeGeometry (*read)(const JsonNode&, const SceneLibrary&);
};

constexpr ShapeKind kShapes[] = {
    {"sphere", "sphere", read_sphere},
    {"capsule", "capsule", read_round<Capsule>},
    {"box", "box",
     [](const JsonNode& node, const SceneLibrary&) -> ShapeGeometry {
       return Box{read_positive3(*node.find("half_extents"))};
     }},
    {"cylinder", "cylinder", read_round<Cylinder>},
    {"cone", "cone", read_round<Cone>},
    {"ellipsoid", "ellipsoid",
     [](const JsonNode& node, const SceneLibrary&) -> ShapeGeometry {
       return Ellipsoid{read_positive3(*node.find("semi_axes"))};
     }},
    {"convex_hull", "convex_hull",
     [](const JsonNode& node, const SceneLibrary& library) -> ShapeGeometry {
       return read_hull(node, library);
     }},
    {"plane", "plane",
     [](const JsonNode& node, const SceneLibrary&) -> ShapeGeometry { return read_plane(node); }},
    {"mesh", "mesh_shape",
     [](const JsonNode& node, const SceneLibrary& library) -> ShapeGeometry {
       return read_mesh_shape(node, library);
     }},
    {"height_field", "height_field",
     [](const JsonNode& node, const SceneLibrary&) -> ShapeGeometry {
       return read_height_field(node);
     }},
};

const ShapeKind& kind_of(const JsonNode& node) {
  if (node.kind != JsonKind::object) node.refuse("an object");
  const JsonNode* type = node.find("type");
  if (!type) node.fail("\"type\" is missing");
  std::vector<std::string_view> types;
  for (const ShapeKind& kind : kShapes) types.push_back(kind.type);
  return kShapes[read_choice(*type, types)];
}

Filter read_filter(const JsonNode& node) {
  constexpr std::int64_t kAll = std::numeric_limits<std::uint32_t>::max();
  using Group = std::numeric_limits<std::int32_t>;
  Filter filter;
  if_given(node, "category", [&](const JsonNode& n) {
    filter.category = static_cast<std::uint32_t>(read_integer(n, 0, kAll));
  });
  if_given(node, "mask", [&](const JsonNode& n) {
    filter.mask = static_cast<std::uint32_t>(read_integer(n, 0, kAll));
  });
  if_given(node, "group", [&](const JsonNode& n) {
    filter.group = static_cast<std::int32_t>(read_integer(n, Group::min(), Group::max()));
  });
  return filter;
}

Shape read_shape(const JsonNode& node, const SceneLibrary& library, const SceneMaterial& body) {
  const ShapeKind& kind = kind_of(node);
  check_object(node, kind.spec);
  ShapeOptions options = {.local_pose = read_pose(node), .filter = read_filter(node)};
  const SceneMaterial matter = read_matter(node, library, body);
  if (names_a_surface(node)) options.material = matter.surface;
  if (node.find("material") || node.find("density")) options.density = matter.density;
  if_given(node, "sensor", [&](const JsonNode& n) { options.sensor = read_bool(n); });
  return std::visit([&](auto geometry) { return Shape(std::move(geometry), options); },
                    kind.read(node, library));
}

// -- Mass and motion --------------------------------------------------------------------------------

Mat3 read_inertia(const JsonNode& node) {
  const auto& rows = read_list(node, 3);
  if (rows[0]->kind == JsonKind::number) return read_positive3(node).asDiagonal();
  if (rows.size() != 3) node.refuse("three principal moments or three rows of three");
  Mat3 inertia;
  for (int i = 0; i < 3; ++i) {
    inertia.row(i) = read_vec3(*rows[static_cast<std::size_t>(i)]).transpose();
  }
  return inertia;
}

MassOverride read_mass(const JsonNode& node) {
  if (node.kind == JsonKind::number) return {read_positive(node)};
  check_object(node, "mass");
  MassOverride mass = {read_positive(*node.find("mass"))};
  if_given(node, "center", [&](const JsonNode& n) { mass.center = read_vec3(n); });
  if_given(node, "inertia", [&](const JsonNode& n) { mass.inertia = read_inertia(n); });
  return mass;
}

AxisLocks read_locks(const JsonNode& node) {
  check_object(node, "locks");
  AxisLocks locks;
  if_given(node, "translation", [&](const JsonNode& n) { locks.translation = read_bool3(n); });
  if_given(node, "rotation", [&](const JsonNode& n) { locks.rotation = read_bool3(n); });
  return locks;
}

void read_motion(const JsonNode& node, BodyDesc& body) {
  const auto number = [&](std::string_view field, double& value, double (*read)(const JsonNode&)) {
    if_given(node, field, [&](const JsonNode& n) { value = read(n); });
  };
  const auto flag = [&](std::string_view field, bool& value) {
    if_given(node, field, [&](const JsonNode& n) { value = read_bool(n); });
  };
  const auto vector = [&](std::string_view field, Vec3& value) {
    if_given(node, field, [&](const JsonNode& n) { value = read_vec3(n); });
  };
  vector("linear_velocity", body.linear_velocity);
  vector("angular_velocity", body.angular_velocity);
  number("gravity_scale", body.gravity_scale, read_number);
  number("linear_damping", body.linear_damping, read_not_negative);
  number("angular_damping", body.angular_damping, read_not_negative);
  flag("allow_sleep", body.allow_sleep);
  flag("awake", body.awake);
  if_given(node, "continuous", [&](const JsonNode& n) {
    constexpr std::string_view kNames[] = {"automatic", "never"};
    constexpr ContinuousCollision kValues[] = {ContinuousCollision::automatic,
                                               ContinuousCollision::never};
    body.continuous = kValues[read_choice(n, kNames)];
  });
}

BodyType read_body_type(const JsonNode& node) {
  constexpr std::string_view kTypes[] = {"dynamic", "fixed", "kinematic"};
  constexpr BodyType kValues[] = {BodyType::dynamic, BodyType::fixed, BodyType::kinematic};
  return kValues[read_choice(node, kTypes)];
}

}  // namespace

void fail_unknown(const JsonNode& node, const std::string& what,
                  std::span<const std::string> known) {
  node.fail("unknown " + what + " " + node.shown() + did_you_mean(node.text, known));
}

SceneMaterial read_material(const JsonNode& node) {
  check_object(node, "material");
  return read_matter(node, {}, {});
}

Pose read_pose(const JsonNode& object) {
  Pose pose;
  if_given(object, "position", [&](const JsonNode& n) { pose.position = read_vec3(n); });
  if_given(object, "orientation",
           [&](const JsonNode& n) { pose.orientation = read_orientation(n); });
  return pose;
}

BodyDesc read_body(const JsonNode& node, const SceneLibrary& library) {
  check_object(node, "body");
  BodyDesc body;
  if_given(node, "type", [&](const JsonNode& n) { body.type = read_body_type(n); });
  const SceneMaterial matter = read_matter(node, library, {});
  body.friction = matter.surface.friction;
  body.restitution = matter.surface.restitution;
  body.rolling_resistance = matter.surface.rolling_resistance;
  body.density = matter.density;
  if_given(node, "shapes", [&](const JsonNode& list) {
    for (const JsonNode* shape : read_list(list, 0)) {
      body.shapes.push_back(read_shape(*shape, library, matter));
    }
  });
  const Pose pose = read_pose(node);
  body.position = pose.position;
  body.orientation = pose.orientation;
  read_motion(node, body);
  if_given(node, "mass", [&](const JsonNode& n) { body.mass = read_mass(n); });
  if_given(node, "locks", [&](const JsonNode& n) { body.locks = read_locks(n); });
  if_given(node, "user_data", [&](const JsonNode& n) {
    body.user_data = static_cast<std::uint64_t>(read_integer(n, 0, std::int64_t{1} << 53));
  });
  return body;
}

}  // namespace skerry::scenes
