// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/tessellate.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>
#include "surfaces/base/error.h"
#include "surfaces/hspline/patch_tree.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::surfaces {

Tessellation Tessellate(const HSplineSurface& surface, int per_patch) {
  if (per_patch < 1) {
    throw InputError(
        fmt::format("tessellation: {} quads along a patch side; at least 1 is needed", per_patch));
  }
  const HSplineShape& shape = surface.shape();
  const int quads_u = per_patch * shape.PatchesU(shape.max_level),
            quads_v = per_patch * shape.PatchesV(shape.max_level);
  const int columns = quads_u + (shape.ClosedU() ? 0 : 1), rows = quads_v + 1;
  Tessellation result;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const Vec2 uv(double(i) / quads_u, double(j) / quads_v);
      const SurfaceFrame frame = surface.Frame(uv);
      result.uv.push_back(uv);
      result.mesh.points.push_back(frame.point);
      result.normals.push_back(frame.Normal());
    }
  }
  for (int j = 0; j < quads_v; ++j) {
    for (int i = 0; i < quads_u; ++i) {
      const int i1 = (i + 1) % columns;
      const int a = i + columns * j, b = i1 + columns * j, c = a + columns, d = b + columns;
      result.mesh.triangles.push_back({a, b, d});
      result.mesh.triangles.push_back({a, d, c});
    }
  }
  return result;
}

std::array<DomainCell, 4> Children(const DomainCell& c) {
  return {DomainCell{c.level + 1, 2 * c.i, 2 * c.j}, DomainCell{c.level + 1, 2 * c.i + 1, 2 * c.j},
          DomainCell{c.level + 1, 2 * c.i, 2 * c.j + 1},
          DomainCell{c.level + 1, 2 * c.i + 1, 2 * c.j + 1}};
}

// The second derivatives are convex combinations of the control vertices' second differences.
double ChordBound(const HSplineSurface& surface, const DomainCell& cell) {
  const int level = std::min(cell.level, surface.shape().max_level), finer = cell.level - level;
  const std::array<Vec3, 16> p = surface.PatchVertices({level, cell.i >> finer, cell.j >> finer});
  double uu = 0, uv = 0, vv = 0;
  for (int b = 0; b < 4; ++b) {
    for (int a = 0; a < 2; ++a) {
      const int row = a + 4 * b, column = b + 4 * a;
      uu = std::max(uu, (p[row] - 2 * p[row + 1] + p[row + 2]).norm());
      vv = std::max(vv, (p[column] - 2 * p[column + 4] + p[column + 8]).norm());
    }
  }
  for (int k = 0; k < 9; ++k) {
    const int at = k % 3 + 4 * (k / 3);
    uv = std::max(uv, (p[at] - p[at + 1] - p[at + 4] + p[at + 5]).norm());
  }
  return std::ldexp((uu + 2 * uv + vv) / 8, -2 * finer);
}

namespace {

[[noreturn]] void TooFine(double chord_mm) {
  throw InputError(fmt::format(
      "tessellation: a chord error of {} mm needs too many triangles; allow a larger one",
      chord_mm));
}

// Counts the cells into which a cell must be split; infinite if they would be too small. Beyond the
// finest level each split quarters the bound, so that the count needs no actual cells.
double CellsWithin(const HSplineSurface& surface, const DomainCell& cell, double chord_mm) {
  const double bound = ChordBound(surface, cell);
  if (bound <= chord_mm) {
    return 1;
  }
  if (cell.level >= surface.shape().max_level) {
    const double splits = std::ceil(std::log2(bound / chord_mm) / 2);
    return cell.level + splits > kDeepestCell ? std::numeric_limits<double>::infinity()
                                              : std::ldexp(1, 2 * static_cast<int>(splits));
  }
  double count = 0;
  for (const DomainCell& child : Children(cell)) {
    count += CellsWithin(surface, child, chord_mm);
  }
  return count;
}

void SplitToChord(const HSplineSurface& surface, const DomainCell& cell, double chord_mm,
                  std::set<DomainCell>& cells) {
  if (ChordBound(surface, cell) <= chord_mm) {
    cells.insert(cell);
    return;
  }
  if (cell.level == kDeepestCell) {
    TooFine(chord_mm);
  }
  for (const DomainCell& child : Children(cell)) {
    SplitToChord(surface, child, chord_mm, cells);
  }
}

// Splits the cell that covers `fine`, if any, until it is coarser by at most one level.
void RefineAt(const DomainCell& fine, std::set<DomainCell>& cells, std::vector<DomainCell>& open) {
  for (int up = 0; up <= fine.level; ++up) {
    const DomainCell cell{fine.level - up, fine.i >> up, fine.j >> up};
    if (up < 2 && cells.contains(cell)) {
      return;
    }
    if (up >= 2 && cells.erase(cell) > 0) {
      for (const DomainCell& child : Children(cell)) {
        cells.insert(child);
        open.push_back(child);
      }
      RefineAt(fine, cells, open);
      return;
    }
  }
}

}  // namespace

double CellsToChord(const HSplineSurface& surface, double chord_mm) {
  double count = 0;
  const PatchTree patches(surface);
  for (const PatchId& leaf : patches.leaves()) {
    count += CellsWithin(surface, leaf, chord_mm);
  }
  return count;
}

std::set<DomainCell> CellsWithinChord(const HSplineSurface& surface, double chord_mm) {
  if (!(chord_mm > 0) || !std::isfinite(chord_mm)) {
    throw InputError(fmt::format(
        "tessellation: the chord error is {} mm; it must be above 0 and finite", chord_mm));
  }
  if (!(CellsToChord(surface, chord_mm) <= kMaxCells)) {
    TooFine(chord_mm);
  }
  std::set<DomainCell> cells;
  const PatchTree patches(surface);
  for (const PatchId& leaf : patches.leaves()) {
    SplitToChord(surface, leaf, chord_mm, cells);
  }
  return cells;
}

void BalanceCells(const HSplineShape& shape, std::set<DomainCell>& cells) {
  std::vector<DomainCell> open(cells.begin(), cells.end());
  while (!open.empty()) {
    const DomainCell cell = open.back();
    open.pop_back();
    if (!cells.contains(cell)) {
      continue;  // already split
    }
    for (const auto& [i, j] : {std::pair{cell.i - 1, cell.j}, std::pair{cell.i + 1, cell.j},
                               std::pair{cell.i, cell.j - 1}, std::pair{cell.i, cell.j + 1}}) {
      const DomainCell beside{cell.level, WrapIndex(shape.PatchesU(cell.level), i, shape.ClosedU()),
                              WrapIndex(shape.PatchesV(cell.level), j, false)};
      if (beside.i >= 0 && beside.j >= 0) {
        RefineAt(beside, cells, open);
      }
    }
  }
}

namespace {

// Triangulates the cells of a quadtree. Vertices are identified by their place on the finest
// lattice.
class Triangulation {
 public:
  Triangulation(const HSplineShape& shape, const std::set<DomainCell>& cells) : shape_(shape) {
    vertices_.reserve(cells.size());
    for (const DomainCell& cell : cells) {
      const std::array<std::int64_t, 3> box = Box(cell);
      for (int k = 0; k < 4; ++k) {
        Vertex(box[0] + k % 2 * box[2], box[1] + k / 2 * box[2]);
      }
    }
    corners_ = static_cast<int>(result_.uv.size());
    for (const DomainCell& cell : cells) {
      Emit(Box(cell));
    }
  }

  Tessellation Take() && { return std::move(result_); }

 private:
  // Lowest u and v, and size, in lattice units.
  static std::array<std::int64_t, 3> Box(const DomainCell& cell) {
    const std::int64_t size = 2 << (kDeepestCell - cell.level);
    return {cell.i * size, cell.j * size, size};
  }

  // Lattice steps along u and v.
  std::int64_t Columns() const { return shape_.patches_u * (std::int64_t{2} << kDeepestCell); }
  std::int64_t Rows() const { return shape_.patches_v * (std::int64_t{2} << kDeepestCell); }

  // Index of a lattice point, row by row. Both sides of a seam have the same index.
  std::int64_t LatticeIndex(std::int64_t x, std::int64_t y) const {
    return y * (Columns() + 1) + (shape_.ClosedU() ? x % Columns() : x);
  }

  int Vertex(std::int64_t x, std::int64_t y) {
    const std::int64_t place = LatticeIndex(x, y);
    const auto [vertex, is_new] = vertices_.emplace(place, static_cast<int>(result_.uv.size()));
    if (is_new) {
      const std::int64_t across = Columns() + 1;
      result_.uv.emplace_back(static_cast<double>(place % across) / static_cast<double>(Columns()),
                              static_cast<double>(place / across) / static_cast<double>(Rows()));
    }
    return vertex->second;
  }

  void Emit(const std::array<std::int64_t, 3>& box) {
    const auto [x, y, size] = box;
    const std::int64_t half = size / 2;
    // Corners and edge midpoints counter-clockwise from the lowest corner. A midpoint is a vertex
    // only if a neighbour is finer.
    const std::array<std::pair<std::int64_t, std::int64_t>, 8> around = {{{x, y},
                                                                          {x + half, y},
                                                                          {x + size, y},
                                                                          {x + size, y + half},
                                                                          {x + size, y + size},
                                                                          {x + half, y + size},
                                                                          {x, y + size},
                                                                          {x, y + half}}};
    std::vector<int> ring;
    for (const auto& [px, py] : around) {
      if (const auto found = vertices_.find(LatticeIndex(px, py));
          found != vertices_.end() && found->second < corners_) {
        ring.push_back(found->second);
      }
    }
    std::vector<Triangle>& triangles = result_.mesh.triangles;
    if (ring.size() == 4) {
      triangles.push_back({ring[0], ring[1], ring[2]});
      triangles.push_back({ring[0], ring[2], ring[3]});
      return;
    }
    const int center = Vertex(x + half, y + half);
    for (std::size_t k = 0; k < ring.size(); ++k) {
      triangles.push_back({center, ring[k], ring[(k + 1) % ring.size()]});
    }
  }

  HSplineShape shape_;
  std::unordered_map<std::int64_t, int> vertices_;  // by lattice index
  int corners_ = 0;  // number of vertices at cells' corners; the others are cells' centers
  Tessellation result_;
};

// Makes two triangles per cell, or a fan of up to eight if a neighbour is finer. The cells must
// cover the domain. They are balanced first (BalanceCells).
Tessellation TessellateCells(const HSplineSurface& surface, std::set<DomainCell> cells,
                             int threads) {
  BalanceCells(surface.shape(), cells);
  Tessellation result = Triangulation(surface.shape(), cells).Take();
  SurfaceSamples samples = HSplineBatch(surface).PointsAndNormals(result.uv, threads);
  result.mesh.points = std::move(samples.points);
  result.normals = std::move(samples.normals);
  return result;
}

}  // namespace

Tessellation TessellateToChord(const HSplineSurface& surface, double chord_mm, int threads) {
  return TessellateCells(surface, CellsWithinChord(surface, chord_mm), threads);
}

}  // namespace semblance::surfaces
