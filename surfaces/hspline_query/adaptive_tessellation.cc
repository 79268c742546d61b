// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/adaptive_tessellation.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "surfaces/hspline_query/hspline_batch.h"
#include "surfaces/hspline_query/surface_cells.h"

namespace semblance {
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
    return (shape_.ClosedV() ? y % Rows() : y) * (Columns() + 1) +
           (shape_.ClosedU() ? x % Columns() : x);
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

}  // namespace semblance
