// SPDX-License-Identifier: GPL-3.0-or-later
// Closed meshes that rays from no centre meet once, by `parameters: mesh`: the layout, and the
// fitted surface's distance from the truth; the peer is the same fit of the same (u,v) as given
// ones, which knows of no poles.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "fitting/closed_mesh/closed_map.h"
#include "problems/points/point_fit.h"
#include "surfaces/base/quantile.h"
#include "tests/bench/fit_measure.h"
#include "tests/testing/closed_shapes.h"

namespace semblance::bench {
namespace {

// The area that is left of each triangle's, by the areas in space; 1: all are alike.
std::vector<WeightedValue> AreasLeft(const TriMesh& mesh, const std::vector<Vec3>& at) {
  const double scale = 4 * std::numbers::pi / Area(mesh);
  std::vector<WeightedValue> left;
  for (const Triangle& t : mesh.triangles) {
    const double area = TriangleAreaVector(mesh, t).norm();
    const Vec3& a = at[t[0]];
    left.push_back({a.dot((at[t[1]] - a).cross(at[t[2]] - a)) / 2 / (scale * area), area});
  }
  std::ranges::sort(left, {}, &WeightedValue::value);
  return left;
}

void RunLayout(const std::string& entry, const TriMesh& mesh) {
  const double start_s = CpuSecondsSoFar();
  const ClosedLayout layout = LayOutOnSphere(mesh);
  Print(entry + "_layout_cpu", CpuSecondsSoFar() - start_s, kNaN, kNaN, "s");
  Print(entry + "_folded", layout.folded, kNaN, kNaN, "share");
  const std::vector<WeightedValue> left = AreasLeft(mesh, layout.at);
  for (const int percent : {0, 1, 50, 99, 100}) {
    Print(fmt::format("{}_area_left_{}", entry, percent), Quantile(left, percent / 100.0), kNaN,
          kNaN, "ratio");
  }
}

struct Closed {
  double rms_mm = kNaN, pole_rms_mm = kNaN, gap_mm = 0;
};

Closed Measure(const HSplineSurface& surface, const testing::ClosedShape& shape) {
  constexpr double kPole = 1.0 / 18;  // ten degrees
  Closed closed{.rms_mm = testing::ErrorsOf(surface, shape, 0, 1).rms,
                .pole_rms_mm = std::max(testing::ErrorsOf(surface, shape, 0, kPole).rms,
                                        testing::ErrorsOf(surface, shape, 1 - kPole, 1).rms)};
  for (const PoleGap& pole : PoleGapsOf(surface)) {
    closed.gap_mm = std::max(closed.gap_mm, pole.gap_mm);
  }
  return closed;
}

void RunOne(const testing::ClosedShape& shape, int count, double noise) {
  const TriMesh mesh = testing::MeshOf(shape, count, noise);
  const std::string entry = fmt::format("fit.closed.{}_{}_noise_{:g}", shape.name, count, noise);
  RunLayout(entry, mesh);
  PointTable table;
  table.positions = mesh.points;
  table.triangles = mesh.triangles;
  PointFitOptions options;
  options.closure = Closure::kPeriodicU;
  options.parameters = MeshParameters{};
  const double start_s = CpuSecondsSoFar();
  const PointFit fit = FitPoints(table, options, {});
  Print(entry + "_all_cpu", CpuSecondsSoFar() - start_s, kNaN, kNaN, "s");
  table.triangles.clear();
  table.uv = fit.fit.uv;
  options.parameters = GivenParameters{};
  const PointFit plain = FitPoints(table, options, {});
  const Closed ours = Measure(fit.fit.surface, shape), other = Measure(plain.fit.surface, shape);
  Print(entry + "_rms", ours.rms_mm, other.rms_mm, kNaN, "mm");
  Print(entry + "_pole_rms", ours.pole_rms_mm, other.pole_rms_mm, kNaN, "mm");
  Print(entry + "_gap", ours.gap_mm, other.gap_mm, kNaN, "mm");
  Print(entry + "_held_out", fit.fit.automatic->held_out_rms_mm,
        plain.fit.automatic->held_out_rms_mm, kNaN, "mm");
}

void RunAll() {
  for (const testing::ClosedShape& shape : testing::ClosedShapes()) {
    for (const double noise : {0.0, 1e-3}) {
      RunOne(shape, 10000, noise);
    }
    RunOne(shape, 100000, 1e-3);
  }
}

}  // namespace
}  // namespace semblance::bench

int main() { semblance::bench::RunAll(); }
