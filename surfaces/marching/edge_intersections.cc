// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/marching/edge_intersections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace semblance::surfaces {
namespace {

// An interval of an edge: the field is positive at one end and not at the other.
struct Bracket {
  double a, fa, b, fb;

  double SecantRoot(double weight_a = 1, double weight_b = 1) const {
    return a + (b - a) * (weight_a * fa) / (weight_a * fa - weight_b * fb);
  }
  // Replaces the end that has the sign of f by (x, f). Returns true if that was the upper end.
  bool Narrow(double x, double f) {
    const bool lower = (f > 0) == (fa > 0);
    (lower ? a : b) = x;
    (lower ? fa : fb) = f;
    return !lower;
  }
};

using LineField = std::function<double(double)>;

double Bisect(Bracket e, double tolerance, const LineField& field, std::int64_t& evaluations) {
  while (e.b - e.a > tolerance) {
    const double middle = 0.5 * (e.a + e.b);
    e.Narrow(middle, field(middle));
    ++evaluations;
  }
  return 0.5 * (e.a + e.b);
}

// An estimate of the crossing from the ends and a point (x, f) between them. A convex or concave
// function lies between its chords. Hence the crossing lies between the zeros of the chords from
// both ends to the point.
struct Estimate {
  double at;            // zero of the parabola (position as a function of value) through the three
  double uncertain_by;  // NaN if the values are not monotonic
};

Estimate EstimateCrossing(const Bracket& e, double x, double f) {
  const double lower = (x - e.a) / (f - e.fa), upper = (e.b - x) / (e.fb - f);
  if (!(lower * upper > 0)) {
    return {x, f == 0 ? 0 : kNaN};
  }
  const double bend = (upper - lower) / (e.fb - e.fa);
  const auto [least, most] = std::minmax({x - f * lower, x - f * upper});
  return {std::clamp(e.a - e.fa * (lower - bend * f), least, most), most - least};
}

// The Illinois variant of regula falsi: the value of an end that stays twice is halved. Stops once
// three values determine the crossing within the tolerance, provided that the field is convex or
// concave between them.
double FalsePosition(Bracket e, double tolerance, const LineField& field,
                     std::int64_t& evaluations) {
  constexpr int kMaxSteps = 60;
  double weight_a = 1, weight_b = 1;
  bool last_upper = false;
  for (int step = 0; step < kMaxSteps && e.b - e.a > tolerance; ++step) {
    const double x = e.SecantRoot(weight_a, weight_b), f = field(x);
    ++evaluations;
    const Estimate crossing = EstimateCrossing(e, x, f);
    if (crossing.uncertain_by <= tolerance) {
      return std::clamp(crossing.at, e.a, e.b);
    }
    const bool upper = e.Narrow(x, f);
    const bool again = step > 0 && upper == last_upper;
    weight_a = upper && again ? 0.5 * weight_a : 1;
    weight_b = !upper && again ? 0.5 * weight_b : 1;
    last_upper = upper;
  }
  return e.SecantRoot();
}

// Connects the crossings to triangles. As cells ascend, the ids of their e-th edges ascend too, so
// that one forward cursor per cell edge finds all ids.
std::vector<Triangle> Connect(const SampleGrid& grid, const EdgeIntersections& intersections) {
  std::array<std::size_t, 12> cursor{};
  std::vector<Triangle> triangles;
  for (const CrossedCell& cell : intersections.cells) {
    const GridIndex at = grid.At(cell.index);
    for (std::size_t e = 0; e < kCellEdges.size(); ++e) {
      const std::int64_t id = EdgeId(grid, at, kCellEdges[e]);
      while (cursor[e] < intersections.edges.size() && intersections.edges[cursor[e]].id < id) {
        ++cursor[e];
      }
    }
    for (const auto& corners : MarchingCubesCases()[cell.mask]) {
      if ((cell.edges >> corners[0] & 1) == 0) {
        continue;  // belongs to another sheet in the cell
      }
      triangles.push_back({static_cast<std::int32_t>(cursor[corners[0]]),
                           static_cast<std::int32_t>(cursor[corners[1]]),
                           static_cast<std::int32_t>(cursor[corners[2]])});
    }
  }
  return triangles;
}

bool TouchesBorder(const SampleGrid& grid, const std::vector<CrossedCell>& cells) {
  return std::any_of(cells.begin(), cells.end(), [&](const CrossedCell& cell) {
    const GridIndex at = grid.At(cell.index);
    return at[0] == 0 || at[1] == 0 || at[2] == 0 || at[0] + 2 == grid.counts[0] ||
           at[1] + 2 == grid.counts[1] || at[2] + 2 == grid.counts[2];
  });
}

}  // namespace

EdgeLine MakeEdgeLine(const SampleGrid& grid, const CrossedEdge& edge) {
  const GridIndex low = grid.At(edge.id / 3);
  GridIndex high = low;
  ++high[edge.id % 3];
  const Vec3 from = grid.Corner(low);
  return {from, grid.Corner(high) - from};
}

std::int64_t EdgeId(const SampleGrid& grid, const GridIndex& cell, const CellEdge& edge) {
  const int c = edge.from;
  return 3 * grid.Index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)) +
         edge.axis;
}

double SearchCrossing(double from, double to, const EdgeSearchOptions& options,
                      const LineField& field, std::int64_t& evaluations) {
  return (options.method == EdgeSearch::kBisection ? Bisect : FalsePosition)(
      {0, from, 1, to}, options.tolerance, field, evaluations);
}

PolygonizeResult BuildMesh(const SampleGrid& grid, EdgeIntersections intersections) {
  std::vector<CrossedEdge>& edges = intersections.edges;
  std::sort(edges.begin(), edges.end(),
            [](const CrossedEdge& a, const CrossedEdge& b) { return a.id < b.id; });
  PolygonizeResult result;
  result.mesh.points.reserve(edges.size());
  for (const CrossedEdge& edge : edges) {
    result.mesh.points.push_back(MakeEdgeLine(grid, edge).At(edge.at));
  }
  result.mesh.triangles = Connect(grid, intersections);
  result.touches_border = TouchesBorder(grid, intersections.cells);
  result.summary = intersections.summary;
  result.summary.active_cells = static_cast<std::int64_t>(intersections.cells.size());
  return result;
}

}  // namespace semblance::surfaces
