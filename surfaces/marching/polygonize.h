// SPDX-License-Identifier: GPL-3.0-or-later
// Polygonises a scalar field by marching cubes on a regular grid (thesis 3.2). Each crossing is
// found by a search along its edge.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/marching/marching_cubes.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

using GridIndex = std::array<int, 3>;

// A grid of corners (i, j, k), 0 <= i < counts[0] etc., at origin + (i, j, k) * cell_mm.
struct SampleGrid {
  Vec3 origin = Vec3::Constant(kNaN);
  Vec3 cell_mm = Vec3::Constant(kNaN);  // > 0
  GridIndex counts = {0, 0, 0};         // each >= 2

  Vec3 Corner(int i, int j, int k) const {
    return origin + Vec3(i * cell_mm.x(), j * cell_mm.y(), k * cell_mm.z());
  }
  Vec3 Corner(const GridIndex& at) const { return Corner(at[0], at[1], at[2]); }
  std::int64_t Index(int i, int j, int k) const {
    return i + std::int64_t{counts[0]} * (j + std::int64_t{counts[1]} * k);
  }
  std::int64_t Index(const GridIndex& at) const { return Index(at[0], at[1], at[2]); }
  GridIndex At(std::int64_t index) const {
    return {static_cast<int>(index % counts[0]), static_cast<int>(index / counts[0] % counts[1]),
            static_cast<int>(index / (std::int64_t{counts[0]} * counts[1]))};
  }
  std::int64_t CornerCount() const { return std::int64_t{counts[0]} * counts[1] * counts[2]; }
};

// Throws InputError unless origin and cell are finite, cells are positive, and each axis has 2
// corners.
void CheckGrid(const SampleGrid& grid);

// Positive inside, negative outside. Several threads call it at once.
using ScalarField = std::function<double(const Vec3&)>;

enum class EdgeSearch { kBisection, kRegulaFalsi };
constexpr auto EnumNames(EdgeSearch) {
  return std::to_array<std::string_view>({"bisection", "regula_falsi"});
}

struct EdgeSearchOptions {
  EdgeSearch method = EdgeSearch::kRegulaFalsi;
  double tolerance = 1e-3;
};
template <class Visitor>
void Fields(Visitor& visit, EdgeSearchOptions& o) {
  visit(FieldInfo{.name = "method",
                  .doc = "search for a crossing on a cell's edge: bisection (thesis 3.2.1), or "
                         "regula_falsi (Illinois), the same point in fewer evaluations"},
        o.method);
  visit(FieldInfo{.name = "tolerance",
                  .min = 1e-9,
                  .max = 0.5,
                  .doc = "accuracy of a crossing, as a share of the edge; regula_falsi keeps it "
                         "where the field is convex or concave along the edge"},
        o.tolerance);
}

// Work counts: evaluations of the field at grid corners and in searches along edges, and, for sums
// of emitters, evaluations of single emitters and of their bounds.
struct PolygonizeSummary {
  std::int64_t active_cells = 0;
  std::int64_t corner_evaluations = 0;
  std::int64_t edge_evaluations = 0;
  std::int64_t emitter_evaluations = 0;
  std::int64_t bound_evaluations = 0;
};

struct PolygonizeResult {
  TriMesh mesh;                 // outward; one point per crossing, in the order of the grid's edges
  bool touches_border = false;  // true if the surface leaves the grid, where the mesh is open
  PolygonizeSummary summary;
};

// Evaluates every corner of the grid, layer by layer, and keeps two layers (thesis 3.2.1). The
// reference for the faster methods.
PolygonizeResult PolygonizeAll(const ScalarField& field, const SampleGrid& grid,
                               const EdgeSearchOptions& options, const RunContext& context);

// A cell from which a component of the surface is followed.
struct StartCell {
  std::int64_t cell;           // index of the lowest corner
  EdgeBits edges = kAllEdges;  // edges whose crossings, if any, belong to the component
};

// Visits only cells that the surface crosses: from the start cells it continues across every face
// that the surface crosses (Wyvill et al. 1986; Bloomenthal 1988). It finds each component that
// touches a start cell completely, and no other component, not even one that shares a cell with
// them. Memory grows with the surface, not with the grid.
PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const StartCell> starts, const EdgeSearchOptions& options,
                                const RunContext& context);

// Finds the component that passes through all start cells. If the cells are too coarse for one
// component to do so, it finds all components that touch a start cell, and all components that are
// connected to these through shared cells.
PolygonizeResult PolygonizeThrough(const ScalarField& field, const SampleGrid& grid,
                                   std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context);

// Marching cubes over given samples, one per corner in the grid's order, with crossings by linear
// interpolation. Throws InputError if there is not one sample per corner.
PolygonizeResult PolygonizeSamples(std::span<const float> samples, const SampleGrid& grid,
                                   const RunContext& context);

}  // namespace semblance::surfaces
