#include "collision/height_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "collision/box_tree_build.h"
#include "collision/geometry_build.h"
#include "collision/mesh_tree.h"
#include "core/rounding.h"

namespace skerry::collision {

using core::cross;
using core::HeightFieldGeometry;
using core::kNone;

namespace {

// Columns and rows of the corners of the two halves, from the cell's own.
constexpr std::uint32_t kColumn[2][3] = {{0, 0, 1}, {0, 1, 1}};
constexpr std::uint32_t kRow[2][3] = {{0, 1, 1}, {0, 1, 0}};

bool is_hole(const HeightFieldGeometry& field, std::uint32_t cell) {
  return field.cells[cell] == HeightFieldGeometry::kHole;
}

// Across an edge: the triangle, and which corner of it is not on the edge. kNone at a border.
struct Neighbour {
  std::uint32_t triangle = kNone;
  unsigned far = 0;
};
Neighbour neighbour(const HeightFieldGeometry& field, std::uint32_t triangle, unsigned edge) {
  const std::uint32_t columns = cell_columns(field), rows = field.rows - 1;
  const std::uint32_t cell = triangle / 2, c = cell % columns, r = cell / columns;
  const auto in = [&](std::uint32_t other, std::uint32_t half, unsigned far) {
    return is_hole(field, other) ? Neighbour{} : Neighbour{2 * other + half, far};
  };
  if (triangle % 2 == 0) {
    if (edge == 0) return c > 0 ? in(cell - 1, 1, 0) : Neighbour{};
    if (edge == 1) return r + 1 < rows ? in(cell + columns, 1, 1) : Neighbour{};
    return in(cell, 1, 2);
  }
  if (edge == 0) return in(cell, 0, 1);
  if (edge == 1) return c + 1 < columns ? in(cell + 1, 0, 2) : Neighbour{};
  return r > 0 ? in(cell - columns, 0, 0) : Neighbour{};
}

Vec3 corner(const HeightFieldGeometry& field, std::uint32_t triangle, unsigned i) {
  return core::to_double(field_corner(field, triangle, i % 3));
}

bool bends_outward(const HeightFieldGeometry& field, std::uint32_t triangle, unsigned edge) {
  const Neighbour across = neighbour(field, triangle, edge);
  if (across.triangle == kNone) return true;  // borders may give edge contacts
  const Vec3 a = corner(field, triangle, 0);
  const Vec3 area = (corner(field, triangle, 1) - a).cross(corner(field, triangle, 2) - a);
  return is_convex_edge(area, corner(field, triangle, edge), corner(field, triangle, edge + 1),
                        corner(field, across.triangle, across.far));
}

V3f normal_of(const HeightFieldGeometry& field, std::uint32_t triangle) {
  const V3f a = field_corner(field, triangle, 0);
  return direction(
      cross(field_corner(field, triangle, 1) - a, field_corner(field, triangle, 2) - a), {0, 1, 0});
}

[[noreturn]] void refuse(const std::string& sentence) { throw std::invalid_argument(sentence); }

void check(const HeightFieldData& field) {
  if (field.columns < 2 || field.rows < 2)
    refuse("a height field needs at least 2 columns and 2 rows, got " +
           std::to_string(field.columns) + " and " + std::to_string(field.rows));
  const std::uint64_t samples = std::uint64_t{field.columns} * field.rows;
  const std::uint64_t cells = std::uint64_t{field.columns - 1} * (field.rows - 1);
  if (cells > 1u << 30) refuse("the height field has too many cells: " + std::to_string(cells));
  if (field.heights.size() != samples)
    refuse("the height field has " + std::to_string(field.heights.size()) + " heights for " +
           std::to_string(samples) + " samples");
  if (!field.holes.empty() && field.holes.size() != cells)
    refuse("the height field has " + std::to_string(field.holes.size()) + " hole marks for " +
           std::to_string(cells) + " cells");
}

void set_cells(HeightFieldGeometry& field, const HeightFieldData& data) {
  const std::uint32_t columns = cell_columns(field);
  field.cells.assign(std::size_t{columns} * (field.rows - 1), 0);
  for (std::size_t cell = 0; cell < data.holes.size(); ++cell)
    if (data.holes[cell] != 0) field.cells[cell] = HeightFieldGeometry::kHole;
  bool any = false;
  for (std::uint32_t cell = 0; cell < field.cells.size(); ++cell) {
    if (is_hole(field, cell)) continue;
    for (std::uint32_t half = 0; half < 2; ++half)
      for (unsigned i = 0; i < 3; ++i) {
        const float height = field_corner(field, 2 * cell + half, i).y;
        if (!std::isfinite(height))
          refuse("a height of cell " + std::to_string(cell) + " (column " +
                 std::to_string(cell % columns) + ", row " + std::to_string(cell / columns) +
                 ") is not finite");
        field.low = any ? std::min(field.low, height) : height;
        field.high = any ? std::max(field.high, height) : height;
        any = true;
      }
  }
  if (!any) refuse("all cells of the height field are holes");
  for (std::uint32_t cell = 0; cell < field.cells.size(); ++cell) {
    if (is_hole(field, cell)) continue;
    std::uint8_t bits = 0;
    for (unsigned k = 0; k < 6; ++k)
      if (bends_outward(field, 2 * cell + k / 3, k % 3)) bits |= static_cast<std::uint8_t>(1u << k);
    field.cells[cell] = bits;
  }
}

void set_blocks(HeightFieldGeometry& field) {
  const auto count = [](std::uint32_t cells) { return (cells + kBlockCells - 1) / kBlockCells; };
  const std::uint32_t blocks = count(cell_columns(field)) * count(field.rows - 1);
  std::vector<BuildItem> items;
  for (std::uint32_t block = 0; block < blocks; ++block) {
    BuildItem item{empty_box(), block};
    for_cells_of_block(field, block, [&](std::uint32_t cell) {
      for (std::uint32_t half = 0; half < 2; ++half)
        for (unsigned i = 0; i < 3; ++i) {
          const V3f v = field_corner(field, 2 * cell + half, i);
          grow(item.box, {{v.x, v.y, v.z}, {v.x, v.y, v.z}});
        }
    });
    if (item.box.min[0] <= item.box.max[0]) items.push_back(item);
  }
  auto tree = std::make_shared<core::MeshTree>();
  build_nodes(items, tree->nodes);
  field.blocks = std::move(tree);
}

// The cells along one axis that a stretch may meet.
struct Cells {
  std::uint32_t begin = 0, end = 0;
};
Cells cells_between(double low, double high, double step, std::uint32_t count) {
  // Corner coordinates are rounded to float.
  const double slack = 1e-6 * count;
  const double first = std::floor(low / step - slack), last = std::floor(high / step + slack);
  if (!(last >= 0) || !(first < double(count))) return {};
  return {first > 0 ? static_cast<std::uint32_t>(first) : 0,
          last + 1 < double(count) ? static_cast<std::uint32_t>(last) + 1 : count};
}

}  // namespace

V3f field_corner(const HeightFieldGeometry& field, std::uint32_t triangle, unsigned i) {
  const std::uint32_t cell = triangle / 2, half = triangle % 2;
  const std::uint32_t column = cell % cell_columns(field) + kColumn[half][i];
  const std::uint32_t row = cell / cell_columns(field) + kRow[half][i];
  return {core::rounded_to_float(column * field.step_x),
          field.heights[std::size_t{row} * field.columns + column],
          core::rounded_to_float(row * field.step_z)};
}

void find_field_triangles(const HeightFieldGeometry& field, const float min[3], const float max[3],
                          std::vector<std::uint32_t>& triangles) {
  if (min[1] > field.high || max[1] < field.low) return;
  const Cells c = cells_between(double(min[0]), double(max[0]), field.step_x, cell_columns(field));
  const Cells r = cells_between(double(min[2]), double(max[2]), field.step_z, field.rows - 1);
  for (std::uint32_t row = r.begin; row < r.end; ++row)
    for (std::uint32_t column = c.begin; column < c.end; ++column) {
      const std::uint32_t cell = row * cell_columns(field) + column;
      if (is_hole(field, cell)) continue;
      for (std::uint32_t half = 0; half < 2; ++half) {
        const std::uint32_t triangle = 2 * cell + half;
        Aabb box = empty_box();
        for (unsigned i = 0; i < 3; ++i) {
          const V3f v = field_corner(field, triangle, i);
          grow(box, {{v.x, v.y, v.z}, {v.x, v.y, v.z}});
        }
        if (overlap(box, {{min[0], min[1], min[2]}, {max[0], max[1], max[2]}}))
          triangles.push_back(triangle);
      }
    }
}

Triangle field_triangle(const PlacedShape& placed, std::uint32_t triangle) {
  const HeightFieldGeometry& field = *placed.collider->field;
  Triangle t;
  t.index = triangle;
  for (unsigned i = 0; i < 3; ++i)
    t.corner[i] = placed.center + placed.axes * field_corner(field, triangle, i);
  t.normal = placed.axes * normal_of(field, triangle);
  const unsigned convex = field.cells[triangle / 2] >> (triangle % 2 * 3);
  for (unsigned i = 0; i < 3; ++i) {
    t.touchable[i] = (convex >> i & 1) != 0;
    if (!t.touchable[i]) continue;
    const Neighbour across = neighbour(field, triangle, i);
    t.beyond[i] = across.triangle == kNone
                      ? direction(cross(t.corner[(i + 1) % 3] - t.corner[i], t.normal), t.normal)
                      : placed.axes * normal_of(field, across.triangle);
  }
  return t;
}

float field_radius(const HeightFieldGeometry& field) {
  const double x = field.step_x * (field.columns - 1), z = field.step_z * (field.rows - 1);
  const double y = std::max(std::abs(double(field.low)), std::abs(double(field.high)));
  return core::rounded_to_float(std::sqrt(x * x + y * y + z * z) * (1 + 1e-6));
}

std::shared_ptr<const HeightFieldGeometry> build_height_field(const HeightFieldData& data,
                                                              const Vec3& scale) {
  check(data);
  auto field = std::make_shared<HeightFieldGeometry>();
  field->columns = data.columns;
  field->rows = data.rows;
  field->step_x = scale.x();
  field->step_z = scale.z();
  field->heights.reserve(data.heights.size());
  for (const float height : data.heights)
    field->heights.push_back(core::rounded_to_float(double(height) * scale.y() + 0.0));
  set_cells(*field, data);
  set_blocks(*field);
  return field;
}

}  // namespace skerry::collision
