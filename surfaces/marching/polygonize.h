// SPDX-License-Identifier: GPL-3.0-or-later
// From a field to triangles: marching cubes on a regular grid (thesis 3.2), each crossing found by
// a search along its edge.
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

namespace semblance {

using GridIndex = std::array<int, 3>;

// Corners (i, j, k), 0 <= i < counts[0] etc., at origin + (i, j, k) * cell.
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

// Throws InputError unless origin and cell are usable and there are 2 corners each way.
void CheckGrid(const SampleGrid& grid);

// Positive inside, negative outside; called from several threads at once.
using ScalarField = std::function<double(const Vec3&)>;

enum class EdgeSearch { kBisection, kRegulaFalsi };
constexpr auto EnumNames(EdgeSearch) {
  return std::to_array<std::string_view>({"bisection", "regula_falsi"});
}

struct EdgeSearchOptions {
  EdgeSearch method = EdgeSearch::kRegulaFalsi;  // the same point; regula falsi asks less often
  double tolerance = 1e-3;                       // share of the edge
};
template <class Visitor>
void Fields(Visitor& visit, EdgeSearchOptions& o) {
  visit(FieldInfo{.name = "method",
                  .doc = "how a crossing is found on a cell's edge: bisection (thesis 3.2.1), or "
                         "regula_falsi (Illinois), the same point in fewer evaluations"},
        o.method);
  visit(FieldInfo{.name = "tolerance",
                  .min = 1e-9,
                  .max = 0.5,
                  .doc = "of a crossing, as a share of the edge; regula_falsi keeps it where the "
                         "field bends one way along the edge"},
        o.tolerance);
}

// What it took. Evaluations of the field at a corner of the grid and in searches along edges; those
// of single emitters and of bounds on single emitters, where the field is a sum of emitters.
struct PolygonizeSummary {
  std::int64_t active_cells = 0;
  std::int64_t corner_evaluations = 0;
  std::int64_t edge_evaluations = 0;
  std::int64_t emitter_evaluations = 0;
  std::int64_t bound_evaluations = 0;
};

struct PolygonizeResult {
  TriMesh mesh;  // outward, each crossing one point, in the order of the grid's edges
  bool touches_border = false;  // the surface leaves the grid: the mesh is open there
  PolygonizeSummary summary;
};

// All cells of the grid, layer by layer: every corner is evaluated, two layers of them are kept
// (thesis 3.2.1). The reference for the faster ways.
PolygonizeResult PolygonizeAll(const ScalarField& field, const SampleGrid& grid,
                               const EdgeSearchOptions& options, const RunContext& context);

// A cell from which a component of the surface is followed.
struct StartCell {
  std::int64_t cell;           // index of its lowest corner
  EdgeBits edges = kAllEdges;  // those whose crossings, if there are any, the component has
};

// Only the cells that the surface crosses, found from the start cells by going on across every face
// that it crosses (Wyvill et al. 1986; Bloomenthal 1988). Finds all of each component that touches
// a start cell, and no other component: not even one that shares a cell with them. Memory grows
// with the surface, not with the grid.
PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const StartCell> starts, const EdgeSearchOptions& options,
                                const RunContext& context);

// The component that passes through all the start cells. If the first cell's component does not,
// because cells are too coarse, then all components that touch a start cell, and whatever shares a
// cell with these, and so on.
PolygonizeResult PolygonizeThrough(const ScalarField& field, const SampleGrid& grid,
                                   std::span<const StartCell> starts,
                                   const EdgeSearchOptions& options, const RunContext& context);

// Marching cubes over given samples, one per corner in the grid's order; crossings by linear
// interpolation. Throws InputError if their number is not that of the corners.
PolygonizeResult PolygonizeSamples(std::span<const float> samples, const SampleGrid& grid,
                                   const RunContext& context);

}  // namespace semblance
