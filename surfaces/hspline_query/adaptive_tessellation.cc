// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/adaptive_tessellation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>

#include "surfaces/base/error.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance {
namespace {

constexpr int kDeepest = 16;  // below level 0; halves of its cells are the lattice of the vertices

using Cell = PatchId;  // of any depth, deeper than the finest level too

// How far a triangle with its corners on the surface, within a cell, can be from it: an eighth of
// h_u^2 |S_uu| + 2 h_u h_v |S_uv| + h_v^2 |S_vv|, each the largest in the cell. They are bounded by
// second differences of the vertices, of which the derivatives are convex sums.
double ChordBound(const HSplineSurface& surface, const Cell& cell) {
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

std::array<Cell, 4> ChildrenOf(const Cell& c) {
  return {Cell{c.level + 1, 2 * c.i, 2 * c.j}, Cell{c.level + 1, 2 * c.i + 1, 2 * c.j},
          Cell{c.level + 1, 2 * c.i, 2 * c.j + 1}, Cell{c.level + 1, 2 * c.i + 1, 2 * c.j + 1}};
}

[[noreturn]] void TooFine(double chord_mm) {
  throw InputError(fmt::format(
      "tessellation: a chord error of {} mm needs too many triangles; allow more", chord_mm));
}

// Into how many cells a cell is split for its own sake; infinite where they would be too small.
// Beyond the finest level each split quarters the bound, so they need not be made to be counted.
double CellsWithin(const HSplineSurface& surface, const Cell& cell, double chord_mm) {
  const double bound = ChordBound(surface, cell);
  if (bound <= chord_mm) {
    return 1;
  }
  if (cell.level >= surface.shape().max_level) {
    const double splits = std::ceil(std::log2(bound / chord_mm) / 2);
    return cell.level + splits > kDeepest ? std::numeric_limits<double>::infinity()
                                          : std::ldexp(1, 2 * static_cast<int>(splits));
  }
  double count = 0;
  for (const Cell& child : ChildrenOf(cell)) {
    count += CellsWithin(surface, child, chord_mm);
  }
  return count;
}

class Quadtree {
 public:
  Quadtree(const HSplineSurface& surface, double chord_mm) : surface_(surface) {
    if (!(CellsToChord(surface, chord_mm) <= kMostCells)) {
      TooFine(chord_mm);
    }
    const HSplineShape& shape = surface.shape();
    const PatchTree patches(surface);
    for (const PatchId& leaf : patches.leaves()) {
      SplitToChord(leaf, chord_mm);
    }
    std::vector<Cell> open(cells_.begin(), cells_.end());
    while (!open.empty()) {
      const Cell cell = open.back();
      open.pop_back();
      if (!cells_.contains(cell)) {
        continue;  // split since
      }
      for (const auto& [i, j] : {std::pair{cell.i - 1, cell.j}, std::pair{cell.i + 1, cell.j},
                                 std::pair{cell.i, cell.j - 1}, std::pair{cell.i, cell.j + 1}}) {
        const int columns = shape.patches_u << cell.level, rows = shape.patches_v << cell.level;
        const bool periodic = shape.closure == Closure::kPeriodicU;
        if (j >= 0 && j < rows && (periodic || (i >= 0 && i < columns))) {
          RefineAt({cell.level, (i + columns) % columns, j}, open);
        }
      }
    }
  }

  const std::set<Cell>& cells() const { return cells_; }

 private:
  void SplitToChord(const Cell& cell, double chord_mm) {
    if (ChordBound(surface_, cell) <= chord_mm) {
      cells_.insert(cell);
      return;
    }
    if (cell.level == kDeepest) {
      TooFine(chord_mm);
    }
    for (const Cell& child : ChildrenOf(cell)) {
      SplitToChord(child, chord_mm);
    }
  }

  // Splits the cell that covers `fine` until it is coarser by at most one level.
  void RefineAt(const Cell& fine, std::vector<Cell>& open) {
    for (int up = 2; up <= fine.level; ++up) {
      const Cell cell{fine.level - up, fine.i >> up, fine.j >> up};
      if (cells_.erase(cell) > 0) {
        for (const Cell& child : ChildrenOf(cell)) {
          cells_.insert(child);
          open.push_back(child);
        }
        RefineAt(fine, open);
        return;
      }
    }
  }

  const HSplineSurface& surface_;
  std::set<Cell> cells_;
};

// Triangles over a quadtree's cells; vertices by their (v, u) on the finest lattice.
class Triangulation {
 public:
  Triangulation(const HSplineShape& shape, const std::set<Cell>& cells) : shape_(shape) {
    for (const Cell& cell : cells) {
      const std::array<std::int64_t, 3> box = Box(cell);
      for (int k = 0; k < 4; ++k) {
        Vertex(box[0] + k % 2 * box[2], box[1] + k / 2 * box[2]);
      }
    }
    const std::map<std::pair<std::int64_t, std::int64_t>, int> corners = vertices_;
    for (const Cell& cell : cells) {
      Emit(Box(cell), corners);
    }
  }

  Tessellation Take() && { return std::move(result_); }

 private:
  // Lowest u and v, and size, in units of the lattice.
  static std::array<std::int64_t, 3> Box(const Cell& cell) {
    const std::int64_t size = 2 << (kDeepest - cell.level);
    return {cell.i * size, cell.j * size, size};
  }

  std::pair<std::int64_t, std::int64_t> Key(std::int64_t x, std::int64_t y) const {
    const std::int64_t columns = shape_.patches_u * (std::int64_t{2} << kDeepest);
    return {y, shape_.closure == Closure::kPeriodicU ? x % columns : x};
  }

  int Vertex(std::int64_t x, std::int64_t y) {
    const auto [vertex, is_new] = vertices_.emplace(Key(x, y), static_cast<int>(result_.uv.size()));
    if (is_new) {
      const double unit = 2 << kDeepest;
      result_.uv.emplace_back(vertex->first.second / (shape_.patches_u * unit),
                              vertex->first.first / (shape_.patches_v * unit));
    }
    return vertex->second;
  }

  void Emit(const std::array<std::int64_t, 3>& box,
            const std::map<std::pair<std::int64_t, std::int64_t>, int>& corners) {
    const auto [x, y, size] = box;
    const std::int64_t half = size / 2;
    // Counter-clockwise from the lowest corner; in between, where a neighbour is finer.
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
      if (const auto found = corners.find(Key(px, py)); found != corners.end()) {
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
  std::map<std::pair<std::int64_t, std::int64_t>, int> vertices_;
  Tessellation result_;
};

}  // namespace

double CellsToChord(const HSplineSurface& surface, double chord_mm) {
  double count = 0;
  const PatchTree patches(surface);
  for (const PatchId& leaf : patches.leaves()) {
    count += CellsWithin(surface, leaf, chord_mm);
  }
  return count;
}

Tessellation TessellateToChord(const HSplineSurface& surface, double chord_mm, int threads) {
  if (!(chord_mm > 0) || !std::isfinite(chord_mm)) {
    throw InputError(fmt::format(
        "tessellation: a chord error of {} mm; it must be above 0 and finite", chord_mm));
  }
  const Quadtree tree(surface, chord_mm);
  Tessellation result = Triangulation(surface.shape(), tree.cells()).Take();
  SurfaceSamples samples = HSplineBatch(surface).PointsAndNormals(result.uv, threads);
  result.mesh.points = std::move(samples.points);
  result.normals = std::move(samples.normals);
  return result;
}

}  // namespace semblance
