// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/crossings.h"

#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

// A bracket on [0,1] along an edge: the field is positive at one end and not at the other.
struct Bracket {
  double a, fa, b, fb;

  double SecantRoot() const { return a + (b - a) * fa / (fa - fb); }
  // Puts (x, f) in place of the end of its sign; true if that was the upper end.
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

// Regula falsi as of Illinois: an end that stays twice counts half. Ends where the field is so
// small that, by the slope of the bracket at hand, the crossing is within the tolerance.
double FalsePosition(Bracket e, double tolerance, const LineField& field,
                     std::int64_t& evaluations) {
  constexpr int kMostSteps = 60;
  int last = -1;
  for (int step = 0; step < kMostSteps && e.b - e.a > tolerance; ++step) {
    const double x = e.SecantRoot();
    const double slope = std::abs(e.fa - e.fb) / (e.b - e.a);
    const double f = field(x);
    ++evaluations;
    if (std::abs(f) <= 0.5 * tolerance * slope) {
      return x;
    }
    const int upper = e.Narrow(x, f) ? 1 : 0;
    if (upper == last) {
      (upper ? e.fa : e.fb) *= 0.5;
    }
    last = upper;
  }
  return e.SecantRoot();
}

Vec3 PointOn(const SampleGrid& grid, const CrossedEdge& edge) {
  const std::array<int, 3> low = grid.At(edge.id / 3);
  std::array<int, 3> high = low;
  ++high[edge.id % 3];
  const Vec3 a = grid.Corner(low[0], low[1], low[2]);
  return a + edge.at * (grid.Corner(high[0], high[1], high[2]) - a);
}

// As cells ascend, so do the ids of the same edge of each: one place a cell edge, which only goes
// forward, finds them all.
std::vector<Triangle> Connect(const SampleGrid& grid, const Crossings& crossings) {
  std::array<std::size_t, 12> place{};
  std::vector<Triangle> triangles;
  for (const CrossedCell& cell : crossings.cells) {
    const std::array<int, 3> at = grid.At(cell.index);
    for (std::size_t e = 0; e < kCellEdges.size(); ++e) {
      const std::int64_t id = EdgeId(grid, at, kCellEdges[e]);
      while (place[e] < crossings.edges.size() && crossings.edges[place[e]].id < id) {
        ++place[e];
      }
    }
    for (const auto& corners : MarchingCubesCases()[cell.mask]) {
      triangles.push_back({static_cast<std::int32_t>(place[corners[0]]),
                           static_cast<std::int32_t>(place[corners[1]]),
                           static_cast<std::int32_t>(place[corners[2]])});
    }
  }
  return triangles;
}

bool TouchesBorder(const SampleGrid& grid, const std::vector<CrossedCell>& cells) {
  return std::any_of(cells.begin(), cells.end(), [&](const CrossedCell& cell) {
    const std::array<int, 3> at = grid.At(cell.index);
    return at[0] == 0 || at[1] == 0 || at[2] == 0 || at[0] + 2 == grid.counts[0] ||
           at[1] + 2 == grid.counts[1] || at[2] + 2 == grid.counts[2];
  });
}

}  // namespace

std::int64_t EdgeId(const SampleGrid& grid, const std::array<int, 3>& cell, const CellEdge& edge) {
  const int c = edge.from;
  return 3 * grid.Index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)) +
         edge.axis;
}

double SearchCrossing(double from, double to, const EdgeSearchOptions& options,
                      const LineField& field, std::int64_t& evaluations) {
  return (options.method == EdgeSearch::kBisection ? Bisect : FalsePosition)(
      {0, from, 1, to}, options.tolerance, field, evaluations);
}

PolygonizeResult MeshOf(const SampleGrid& grid, Crossings crossings) {
  std::vector<CrossedEdge>& edges = crossings.edges;
  const auto by_id = [](const CrossedEdge& a, const CrossedEdge& b) { return a.id < b.id; };
  std::sort(edges.begin(), edges.end(), by_id);
  PolygonizeResult result;
  result.mesh.points.reserve(edges.size());
  for (const CrossedEdge& edge : edges) {
    result.mesh.points.push_back(PointOn(grid, edge));
  }
  result.mesh.triangles = Connect(grid, crossings);
  result.touches_border = TouchesBorder(grid, crossings.cells);
  result.summary = crossings.summary;
  result.summary.active_cells = static_cast<std::int64_t>(crossings.cells.size());
  return result;
}

}  // namespace semblance
