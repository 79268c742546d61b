// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/polygonize.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surfaces/error.h"
#include "surfaces/marching_cubes.h"
#include "surfaces/parallel.h"

namespace semblance {
namespace {

void CheckGrid(const SampleGrid& grid) {
  const bool sized =
      std::all_of(grid.counts.begin(), grid.counts.end(), [](int n) { return n >= 2; });
  if (!sized || !grid.origin.allFinite() || !(grid.cell_mm.minCoeff() > 0)) {
    throw InputError(
        fmt::format("polygonize: a grid of {} corners is not usable; it needs a finite origin, "
                    "positive cells and 2 corners each way",
                    fmt::join(grid.counts, " x ")));
  }
}

// The sign of every corner that was asked for, and the cells that were found to be crossed.
struct Sampling {
  std::vector<double> value;        // NaN: not evaluated
  std::vector<std::int64_t> cells;  // ascending
  std::int64_t evaluations = 0;
};

int CaseOf(const Sampling& sampling, const SampleGrid& grid, const std::array<int, 3>& cell) {
  int mask = 0;
  for (int c = 0; c < 8; ++c) {
    mask |= (sampling.value[grid.Index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1),
                                       cell[2] + (c >> 2 & 1))] > 0)
            << c;
  }
  return mask;
}

bool IsCell(const SampleGrid& grid, const std::array<int, 3>& cell) {
  return cell[0] >= 0 && cell[1] >= 0 && cell[2] >= 0 && cell[0] + 1 < grid.counts[0] &&
         cell[1] + 1 < grid.counts[1] && cell[2] + 1 < grid.counts[2];
}

void Evaluate(const ScalarField& field, const SampleGrid& grid,
              const std::vector<std::int64_t>& corners, const RunContext& context,
              Sampling& sampling) {
  ParallelFor(corners.size(), context.threads, 64, [&](std::size_t n) {
    const std::array<int, 3> at = grid.At(corners[n]);
    sampling.value[corners[n]] = field(grid.Corner(at[0], at[1], at[2]));
  });
  sampling.evaluations += static_cast<std::int64_t>(corners.size());
}

// Corners of a cell on its lower or upper face across an axis, as a mask.
int FaceMask(int axis, int upper) {
  int mask = 0;
  for (int c = 0; c < 8; ++c) {
    mask |= ((c >> axis & 1) == upper) << c;
  }
  return mask;
}

// Goes on from crossed cells to their neighbours, wave by wave, until no new cell is crossed.
class Continuation {
 public:
  Continuation(const ScalarField& field, const SampleGrid& grid, const RunContext& context)
      : field_(field),
        grid_(grid),
        context_(context),
        seen_cell_(grid.CornerCount(), 0),
        asked_(grid.CornerCount(), 0) {
    sampling_.value.assign(grid.CornerCount(), kNaN);
  }

  Sampling Run(std::span<const std::int64_t> seeds) {
    std::vector<std::int64_t> wave;
    for (const std::int64_t cell : seeds) {
      Visit(grid_.At(cell), wave);
    }
    while (!wave.empty()) {
      context_.ThrowIfStopped();
      context_.Report("polygonize");
      Evaluate(field_, grid_, UnknownCorners(wave), context_, sampling_);
      wave = Cross(wave);
    }
    std::sort(sampling_.cells.begin(), sampling_.cells.end());
    return std::move(sampling_);
  }

 private:
  void Visit(const std::array<int, 3>& cell, std::vector<std::int64_t>& wave) {
    if (IsCell(grid_, cell) && !seen_cell_[grid_.Index(cell[0], cell[1], cell[2])]) {
      seen_cell_[grid_.Index(cell[0], cell[1], cell[2])] = 1;
      wave.push_back(grid_.Index(cell[0], cell[1], cell[2]));
    }
  }
  std::vector<std::int64_t> UnknownCorners(const std::vector<std::int64_t>& wave) {
    std::vector<std::int64_t> corners;
    for (const std::int64_t cell : wave) {
      const std::array<int, 3> at = grid_.At(cell);
      for (int c = 0; c < 8; ++c) {
        const std::int64_t corner =
            grid_.Index(at[0] + (c & 1), at[1] + (c >> 1 & 1), at[2] + (c >> 2 & 1));
        if (!asked_[corner]) {
          asked_[corner] = 1;
          corners.push_back(corner);
        }
      }
    }
    return corners;
  }
  std::vector<std::int64_t> Cross(const std::vector<std::int64_t>& wave) {
    std::vector<std::int64_t> next;
    for (const std::int64_t cell : wave) {
      const std::array<int, 3> at = grid_.At(cell);
      const int mask = CaseOf(sampling_, grid_, at);
      if (mask == 0 || mask == 255) {
        continue;
      }
      sampling_.cells.push_back(cell);
      for (int axis = 0; axis < 3; ++axis) {
        for (int upper = 0; upper < 2; ++upper) {
          const int face = FaceMask(axis, upper);
          if ((mask & face) != 0 && (mask & face) != face) {
            std::array<int, 3> neighbour = at;
            neighbour[axis] += upper ? 1 : -1;
            Visit(neighbour, next);
          }
        }
      }
    }
    return next;
  }

  const ScalarField& field_;
  const SampleGrid& grid_;
  const RunContext& context_;
  Sampling sampling_;
  std::vector<char> seen_cell_, asked_;
};

std::vector<std::int64_t> CrossedCells(const Sampling& sampling, const SampleGrid& grid) {
  std::vector<std::int64_t> cells;
  for (int k = 0; k + 1 < grid.counts[2]; ++k) {
    for (int j = 0; j + 1 < grid.counts[1]; ++j) {
      for (int i = 0; i + 1 < grid.counts[0]; ++i) {
        const int mask = CaseOf(sampling, grid, {i, j, k});
        if (mask != 0 && mask != 255) {
          cells.push_back(grid.Index(i, j, k));
        }
      }
    }
  }
  return cells;
}

// A grid edge by number: three times its lower corner plus its axis.
std::int64_t EdgeId(const SampleGrid& grid, const std::array<int, 3>& cell, const CellEdge& edge) {
  const int c = edge.from;
  return 3 * grid.Index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2 & 1)) +
         edge.axis;
}

std::vector<std::int64_t> CrossedEdges(const Sampling& sampling, const SampleGrid& grid) {
  std::vector<std::int64_t> edges;
  for (const std::int64_t cell : sampling.cells) {
    const std::array<int, 3> at = grid.At(cell);
    const int mask = CaseOf(sampling, grid, at);
    for (const CellEdge& edge : kCellEdges) {
      if ((mask >> edge.from & 1) != (mask >> edge.to & 1)) {
        edges.push_back(EdgeId(grid, at, edge));
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

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

double Search(const Bracket& bracket, const EdgeSearchOptions& options, const LineField& field,
              std::int64_t& evaluations) {
  return (options.method == EdgeSearch::kBisection ? Bisect : FalsePosition)(
      bracket, options.tolerance, field, evaluations);
}

// One point for each crossed edge, in their order.
std::vector<Vec3> FindCrossings(const ScalarField& field, const SampleGrid& grid,
                                const Sampling& sampling, const std::vector<std::int64_t>& edges,
                                const EdgeSearchOptions& options, const RunContext& context,
                                std::int64_t& evaluations) {
  std::vector<Vec3> points(edges.size());
  std::vector<std::int64_t> counts(edges.size(), 0);
  ParallelFor(edges.size(), context.threads, 64, [&](std::size_t n) {
    const std::array<int, 3> low = grid.At(edges[n] / 3);
    std::array<int, 3> high = low;
    ++high[edges[n] % 3];
    const Vec3 a = grid.Corner(low[0], low[1], low[2]), b = grid.Corner(high[0], high[1], high[2]);
    const Bracket bracket{0, sampling.value[grid.Index(low[0], low[1], low[2])], 1,
                          sampling.value[grid.Index(high[0], high[1], high[2])]};
    points[n] =
        a + Search(
                bracket, options, [&](double t) { return field(a + t * (b - a)); }, counts[n]) *
                (b - a);
  });
  evaluations = std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  return points;
}

std::vector<Triangle> ConnectCrossings(const SampleGrid& grid, const Sampling& sampling,
                                       const std::vector<std::int64_t>& edges) {
  std::vector<Triangle> triangles;
  for (const std::int64_t cell : sampling.cells) {
    const std::array<int, 3> at = grid.At(cell);
    for (const auto& corners : MarchingCubesCases()[CaseOf(sampling, grid, at)]) {
      Triangle triangle;
      for (int c = 0; c < 3; ++c) {
        const std::int64_t id = EdgeId(grid, at, kCellEdges[corners[c]]);
        triangle[c] = static_cast<std::int32_t>(std::lower_bound(edges.begin(), edges.end(), id) -
                                                edges.begin());
      }
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

bool TouchesBorder(const SampleGrid& grid, const std::vector<std::int64_t>& cells) {
  return std::any_of(cells.begin(), cells.end(), [&](std::int64_t cell) {
    const std::array<int, 3> at = grid.At(cell);
    return at[0] == 0 || at[1] == 0 || at[2] == 0 || at[0] + 2 == grid.counts[0] ||
           at[1] + 2 == grid.counts[1] || at[2] + 2 == grid.counts[2];
  });
}

PolygonizeResult Finish(const ScalarField& field, const SampleGrid& grid, const Sampling& sampling,
                        const EdgeSearchOptions& options, const RunContext& context) {
  PolygonizeResult result;
  const std::vector<std::int64_t> edges = CrossedEdges(sampling, grid);
  result.mesh.points = FindCrossings(field, grid, sampling, edges, options, context,
                                     result.summary.edge_evaluations);
  result.mesh.triangles = ConnectCrossings(grid, sampling, edges);
  result.touches_border = TouchesBorder(grid, sampling.cells);
  result.summary.active_cells = static_cast<std::int64_t>(sampling.cells.size());
  result.summary.corner_evaluations = sampling.evaluations;
  return result;
}

}  // namespace

PolygonizeResult PolygonizeAll(const ScalarField& field, const SampleGrid& grid,
                               const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  Sampling sampling;
  sampling.value.assign(grid.CornerCount(), kNaN);
  std::vector<std::int64_t> corners(grid.CornerCount());
  std::iota(corners.begin(), corners.end(), 0);
  Evaluate(field, grid, corners, context, sampling);
  sampling.cells = CrossedCells(sampling, grid);
  return Finish(field, grid, sampling, options, context);
}

PolygonizeResult PolygonizeFrom(const ScalarField& field, const SampleGrid& grid,
                                std::span<const std::int64_t> seed_cells,
                                const EdgeSearchOptions& options, const RunContext& context) {
  CheckGrid(grid);
  const Sampling sampling = Continuation(field, grid, context).Run(seed_cells);
  return Finish(field, grid, sampling, options, context);
}

PolygonizeResult PolygonizeSamples(std::span<const float> samples, const SampleGrid& grid,
                                   const RunContext& context) {
  CheckGrid(grid);
  if (static_cast<std::int64_t>(samples.size()) != grid.CornerCount()) {
    throw InputError(fmt::format("polygonize: {} samples do not fit a grid of {} corners",
                                 samples.size(), grid.CornerCount()));
  }
  Sampling sampling;
  sampling.value.assign(samples.begin(), samples.end());
  sampling.cells = CrossedCells(sampling, grid);
  PolygonizeResult result;
  const std::vector<std::int64_t> edges = CrossedEdges(sampling, grid);
  result.mesh.points.resize(edges.size());
  ParallelFor(edges.size(), context.threads, 4096, [&](std::size_t n) {
    const std::array<int, 3> low = grid.At(edges[n] / 3);
    std::array<int, 3> high = low;
    ++high[edges[n] % 3];
    const double fa = sampling.value[grid.Index(low[0], low[1], low[2])],
                 fb = sampling.value[grid.Index(high[0], high[1], high[2])];
    const Vec3 a = grid.Corner(low[0], low[1], low[2]);
    result.mesh.points[n] = a + fa / (fa - fb) * (grid.Corner(high[0], high[1], high[2]) - a);
  });
  result.mesh.triangles = ConnectCrossings(grid, sampling, edges);
  result.touches_border = TouchesBorder(grid, sampling.cells);
  result.summary = {static_cast<std::int64_t>(sampling.cells.size()), 0, 0};
  return result;
}

}  // namespace semblance
