// Height fields: their triangles, made when they are asked for.
//
//   Numbers  triangle 2 * cell + half; half 0 has the corners (c, r), (c, r + 1), (c + 1, r + 1),
//            half 1 has (c, r), (c + 1, r + 1), (c + 1, r), for the cell at column c and row r.
//   Threads  const, no state: any number at once.
#pragma once

#include <cstdint>
#include <vector>

#include "collision/narrowphase_kernels.h"
#include "core/colliders.h"

namespace skerry::collision {

// The side of a block of cells, the items of HeightFieldGeometry::blocks. Blocks are numbered row by
// row.
inline constexpr std::uint32_t kBlockCells = 2;

inline std::uint32_t cell_columns(const core::HeightFieldGeometry& field) {
  return field.columns - 1;
}

// Corner i of a triangle, m in the shape frame.
V3f field_corner(const core::HeightFieldGeometry& field, std::uint32_t triangle, unsigned i);

// Calls visit(cell) for the cells of a block that are no holes, ascending.
template <class Visit>
void for_cells_of_block(const core::HeightFieldGeometry& field, std::uint32_t block,
                        const Visit& visit) {
  const std::uint32_t columns = cell_columns(field), rows = field.rows - 1;
  const std::uint32_t across = (columns + kBlockCells - 1) / kBlockCells;
  const std::uint32_t c0 = block % across * kBlockCells, r0 = block / across * kBlockCells;
  for (std::uint32_t r = r0; r < r0 + kBlockCells && r < rows; ++r)
    for (std::uint32_t c = c0; c < c0 + kBlockCells && c < columns; ++c)
      if (field.cells[r * columns + c] != core::HeightFieldGeometry::kHole) visit(r * columns + c);
}

// Appends the triangles whose bounds meet the box (touching counts), ascending.
void find_field_triangles(const core::HeightFieldGeometry& field, const float min[3],
                          const float max[3], std::vector<std::uint32_t>& triangles);

// A triangle, with what its edges may do.
SurfaceTriangle field_triangle(const core::HeightFieldGeometry& field, std::uint32_t triangle);

// Farthest distance of the surface's bounds from the frame's origin, m.
float field_radius(const core::HeightFieldGeometry& field);

}  // namespace skerry::collision
