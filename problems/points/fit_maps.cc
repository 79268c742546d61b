// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline/patch_tree.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::problems {
namespace {

constexpr int kGrid = 141;  // vertices along u and v: odd, so that Halved keeps the borders

// One flag per point: 0 for outliers, which are no points of the surface.
std::vector<char> CountedPoints(const FitResult& fit) {
  std::vector<char> counted(fit.residual_mm.size(), 1);
  if (fit.automatic) {
    for (const std::uint32_t outlier : fit.automatic->outliers) {
      counted[outlier] = 0;
    }
  }
  return counted;
}

// The number of cells along u and v that gives each four evenly spread points; at most one cell per
// vertex.
int CellsAcross(std::size_t points) {
  constexpr int kFewest = 8;
  return std::clamp(static_cast<int>(std::sqrt(static_cast<double>(points)) / 2), kFewest, kGrid);
}

// Gives each vertex the RMS distance of the points in its cell.
void AddSquares(const FitResult& fit, FitGrid& grid) {
  const std::vector<char> counted = CountedPoints(fit);
  const int across = CellsAcross(fit.uv.size());
  const auto cell_at = [&](const Vec2& uv) {
    const auto place = [&](double t) {
      return std::min(across - 1, static_cast<int>(std::clamp(t, 0.0, 1.0) * across));
    };
    return static_cast<std::size_t>(place(uv.y())) * across + place(uv.x());
  };
  std::vector<double> sum(static_cast<std::size_t>(across) * across, 0);
  std::vector<int> count(sum.size(), 0);
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    if (counted[k] != 0 && fit.uv[k].allFinite()) {
      const std::size_t cell = cell_at(fit.uv[k]);
      sum[cell] += fit.residual_mm[k] * fit.residual_mm[k];
      ++count[cell];
    }
  }
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      const std::size_t cell = cell_at({i / (grid.columns - 1.0), j / (grid.rows - 1.0)});
      grid.rms_mm.push_back(count[cell] > 0 ? std::sqrt(sum[cell] / count[cell]) : kNaN);
    }
  }
}

}  // namespace

DistanceQuantiles ComputeQuantiles(const FitResult& fit) {
  const std::vector<char> counted = CountedPoints(fit);
  std::vector<double> known;
  for (std::size_t k = 0; k < counted.size(); ++k) {
    if (counted[k] != 0 && std::isfinite(fit.residual_mm[k])) {
      known.push_back(fit.residual_mm[k]);
    }
  }
  if (known.empty()) {
    return {};
  }
  return {.median_mm = Quantile(known, 0.5),
          .p95_mm = Quantile(known, 0.95),
          .max_mm = *std::ranges::max_element(known)};
}

namespace {

// At a seam the triangles use the vertex of the first column, so that normals do not break there.
int VertexAt(const FitGrid& grid, int i, int j) {
  const bool across = grid.closure == Closure::kPeriodicU && i == grid.columns - 1;
  return (across ? 0 : i) + grid.columns * j;
}

std::vector<Triangle> TrianglesOf(const FitGrid& grid) {
  std::vector<Triangle> triangles;
  for (int j = 0; j + 1 < grid.rows; ++j) {
    for (int i = 0; i + 1 < grid.columns; ++i) {
      const int a = VertexAt(grid, i, j), b = VertexAt(grid, i + 1, j),
                c = VertexAt(grid, i, j + 1), d = VertexAt(grid, i + 1, j + 1);
      triangles.push_back({a, b, d});
      triangles.push_back({a, d, c});
    }
  }
  return triangles;
}

}  // namespace

FitGrid SampleFit(const FitResult& fit, int threads) {
  FitGrid grid{.columns = kGrid,
               .rows = kGrid,
               .closure = fit.surface.shape().closure,
               .mesh = {},
               .rms_mm = {}};
  std::vector<Vec2> uv;
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.columns; ++i) {
      uv.emplace_back(i / (grid.columns - 1.0), j / (grid.rows - 1.0));
    }
  }
  grid.mesh.points = HSplineBatch(fit.surface).Points(uv, threads);
  grid.mesh.triangles = TrianglesOf(grid);
  AddSquares(fit, grid);
  return grid;
}

FitGrid Halved(const FitGrid& grid) {
  FitGrid half{.columns = (grid.columns + 1) / 2,
               .rows = (grid.rows + 1) / 2,
               .closure = grid.closure,
               .mesh = {},
               .rms_mm = {}};
  for (int j = 0; j < half.rows; ++j) {
    for (int i = 0; i < half.columns; ++i) {
      const std::size_t at = 2 * (static_cast<std::size_t>(j) * grid.columns + i);
      half.mesh.points.push_back(grid.mesh.points[at]);
      half.rms_mm.push_back(grid.rms_mm[at]);
    }
  }
  half.mesh.triangles = TrianglesOf(half);
  return half;
}

std::vector<FitCell> FindFitCells(const FitResult& fit) {
  const PatchTree tree(fit.surface);
  const HSplineShape& shape = fit.surface.shape();
  std::vector<FitCell> cells;
  for (const PatchId& leaf : tree.leaves()) {
    const double width = 1.0 / shape.PatchesU(leaf.level),
                 height = 1.0 / shape.PatchesV(leaf.level);
    cells.push_back({.level = leaf.level,
                     .u = leaf.i * width,
                     .v = leaf.j * height,
                     .width = width,
                     .height = height});
  }
  const std::vector<char> counted = CountedPoints(fit);
  for (std::size_t k = 0; k < fit.uv.size(); ++k) {
    if (counted[k] != 0 && fit.uv[k].allFinite()) {
      FitCell& cell = cells[static_cast<std::size_t>(tree.LeafAt(tree.IntoDomain(fit.uv[k])))];
      ++cell.points;
      cell.sum_squares_mm2 += fit.residual_mm[k] * fit.residual_mm[k];
      cell.largest_mm = std::max(cell.largest_mm, fit.residual_mm[k]);
    }
  }
  return cells;
}

ToleranceReport CompareWithTolerance(const FitResult& fit, const AdaptivePlan& plan) {
  ToleranceReport report{.tolerance_mm = plan.tolerance_mm,
                         .regions = static_cast<int>(plan.regions.size())};
  const std::vector<char> counted = CountedPoints(fit);
  const PatchTree tree(fit.surface);
  std::set<std::int32_t> cells;
  for (std::size_t k = 0; k < fit.residual_mm.size(); ++k) {
    if (counted[k] == 0 || !fit.uv[k].allFinite()) {
      continue;
    }
    ++report.points;
    report.largest_mm = std::max(report.largest_mm, fit.residual_mm[k]);
    if (!(fit.residual_mm[k] <= plan.ToleranceAt(fit.uv[k].x(), fit.uv[k].y()))) {
      ++report.beyond;
      cells.insert(tree.LeafAt(tree.IntoDomain(fit.uv[k])));
    }
  }
  report.cells = static_cast<int>(cells.size());
  report.at_finest = static_cast<int>(std::ranges::count_if(cells, [&](std::int32_t cell) {
    return tree.leaves()[static_cast<std::size_t>(cell)].level >= plan.finest;
  }));
  return report;
}

std::string LengthText(double length_mm, std::string_view unit, int digits) {
  return fmt::format("{:.{}g}{}{}", length_mm, digits, unit.empty() ? "" : " ", unit);
}

std::string ToleranceText(const ToleranceReport& r, std::string_view unit) {
  const std::string own = r.regions == 0
                              ? ""
                              : fmt::format(" (or that of {}, where one holds a point)",
                                            r.regions == 1 ? "the region" : "the regions");
  if (r.Met()) {
    return fmt::format("the tolerance of {}{} is met: every one of {} points is within {}",
                       LengthText(r.tolerance_mm, unit), own, r.points,
                       LengthText(r.largest_mm, unit));
  }
  std::string text = fmt::format(
      "THE TOLERANCE WAS MISSED: {} of {} points ({:.3g} %) are farther off than {}{}, "
      "the farthest {}; they lie in {} {}",
      r.beyond, r.points, 100.0 * r.beyond / r.points, LengthText(r.tolerance_mm, unit), own,
      LengthText(r.largest_mm, unit), r.cells, r.cells == 1 ? "cell" : "cells");
  if (r.at_finest > 0) {
    text +=
        fmt::format("; {} of the finest level that was allowed: a higher fit.plan.finest may help",
                    r.at_finest);
  }
  if (r.at_finest < r.cells) {
    text += fmt::format("; {} not refined, for lack of points: see fit.plan.min_points",
                        r.cells - r.at_finest);
  }
  return text;
}

}  // namespace semblance::problems
