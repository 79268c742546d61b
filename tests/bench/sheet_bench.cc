// SPDX-License-Identifier: GPL-3.0-or-later
// Sheets that fold over every plane, by `parameters: mesh` from the points alone; the peers are the
// same points with their true triangles, and with their true (u,v).
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "problems/points/point_fit.h"
#include "surfaces/hspline_query/tessellate.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/bench/fit_measure.h"
#include "tests/testing/bent_sheets.h"
#include "tests/testing/shapes.h"

namespace semblance::bench {
namespace {

// Points of a grid, each off by as much as 0.4 of its cell, with the grid's triangles.
PointTable PointsOf(const testing::Sheet& sheet, int side, double noise_mm) {
  Random random(1);
  PointTable table;
  const TriMesh grid = testing::GridMesh(
      [&](const Vec2& q) -> Vec3 {
        Vec2 at = q + 0.4 / side * Vec2(random.Uniform(-1, 1), random.Uniform(-1, 1));
        at = at.cwiseMax(0).cwiseMin(1);
        table.uv.push_back(at);
        const Vec3 off(random.Normal(), random.Normal(), random.Normal());
        return sheet(at) + noise_mm * off;
      },
      side);
  table.positions = grid.points;
  table.triangles = grid.triangles;
  return table;
}

// Root mean square distance of the true surface from the fitted one, a fiftieth from the edges.
double ErrorOf(const HSplineSurface& surface, const testing::Sheet& sheet) {
  constexpr int kSide = 100;
  constexpr double kEdge = 0.02;
  const MeshQuery query(Tessellate(surface, 8).mesh);
  double squares = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 q = Vec2(k % kSide + 0.5, k / kSide + 0.5) / kSide;
    const double off_mm =
        query.Closest(sheet(Vec2(kEdge, kEdge) + (1 - 2 * kEdge) * q)).distance_mm;
    squares += off_mm * off_mm;
  }
  return std::sqrt(squares) / kSide;
}

struct Fitted {
  double rms_mm = kNaN, held_out_mm = kNaN, cpu_s = kNaN;
};

Fitted FitOf(PointTable table, const Parameters& parameters, const testing::Sheet& sheet) {
  PointFitOptions options;
  options.parameters = parameters;
  const double before_s = CpuSecondsSoFar();
  const PointFit fit = FitPoints(std::move(table), options, {});
  return {.rms_mm = ErrorOf(fit.fit.surface, sheet),
          .held_out_mm = fit.fit.automatic->held_out_rms_mm,
          .cpu_s = CpuSecondsSoFar() - before_s};
}

void RunOne(const testing::NamedSheet& bent, int side, double noise) {
  const testing::Sheet sheet = testing::Wavy(bent.sheet, 0.5);
  const double noise_mm = noise * std::sqrt(testing::AreaOf(sheet)) / side;
  const PointTable given = PointsOf(sheet, side, noise_mm);
  PointTable triangles = given, points = given;
  triangles.uv = points.uv = {};
  points.triangles = {};
  const Fitted ours = FitOf(points, MeshParameters{}, sheet),
               meshed = FitOf(triangles, MeshParameters{}, sheet),
               true_uv = FitOf(given, GivenParameters{}, sheet);
  const std::string entry = fmt::format("fit.sheet.{}_{}_noise_{:g}", bent.name, side, noise);
  Print(entry + "_rms", ours.rms_mm, meshed.rms_mm, kNaN, "mm");
  Print(entry + "_rms_vs_true_uv", ours.rms_mm, true_uv.rms_mm, kNaN, "mm");
  Print(entry + "_held_out", ours.held_out_mm, meshed.held_out_mm, kNaN, "mm");
  Print(entry + "_cpu", ours.cpu_s, meshed.cpu_s, kNaN, "s");
}

void RunAll() {
  for (const testing::NamedSheet& bent : testing::BentSheets()) {
    for (const double noise : {0.0, 0.1, 0.3, 1.0}) {
      RunOne(bent, 140, noise);
    }
  }
  RunOne({"S", testing::Ess}, 447, 0.3);
}

}  // namespace
}  // namespace semblance::bench

int main() { semblance::bench::RunAll(); }
