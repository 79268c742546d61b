// SPDX-License-Identifier: GPL-3.0-or-later
// 1e6 points on one level, against a direct solve of the same normal equations.
#include <Eigen/CholmodSupport>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "fitting/fit.h"
#include "fitting/solve/space_solve.h"
#include "fitting/space/point_cloud.h"
#include "fitting/terms/level_view.h"
#include "surfaces/base/random.h"
#include "tests/bench/fit_parts.h"

namespace semblance::bench {
using namespace problems;
namespace {

constexpr int kPatches = 128;  // 131 x 131 control vertices

HSplineSurface Sheet() {
  const HSplineShape shape{.patches_u = kPatches, .patches_v = kPatches, .max_level = 0};
  ControlNet net{.columns = shape.Columns(0), .rows = shape.Rows(0), .vertices = {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.emplace_back(200.0 * (i - 1) / kPatches, 200.0 * (j - 1) / kPatches, 0);
    }
  }
  return HSplineSurface(shape, net);
}

FitPoint PointAt(double u, double v) {
  const double z = 20 * std::sin(9 * u) * std::cos(7 * v) + 3 * std::sin(40 * u * v);
  return {.label = {}, .position = Vec3(200 * u, 200 * v, z), .uv = Vec2(u, v)};
}

FitTarget Points(int count) {
  Random random(1);
  FitTarget target;
  target.points.reserve(count);
  for (int k = 0; k < count; ++k) {
    const double u = random.Uniform(), v = random.Uniform();
    target.points.push_back(PointAt(u, v));
  }
  return target;
}

LevelView ViewOf(const HSplineSurface& sheet, const FitTarget& target) {
  LevelView view{.grid = {.patches_u = kPatches, .patches_v = kPatches},
                 .start = sheet.Net(0),
                 .rest = sheet.Net(0),
                 .lengths_mm = Vec2(200, 200),
                 .observations = {}};
  view.observations.reserve(target.points.size());
  for (const FitPoint& p : target.points) {
    view.observations.push_back({.uv = p.uv, .position = p.position});
  }
  return view;
}

// The peer: Gram matrix of every patch, point by point, one CHOLMOD factor, three right-hand sides.
double SolveDirectly(const HSplineSurface& sheet, const FitTarget& target) {
  using Matrix = Eigen::SparseMatrix<double>;
  using Gram = Eigen::Matrix<double, 16, 16>;
  const PatchGrid grid{.patches_u = kPatches, .patches_v = kPatches};
  const int vertices = sheet.Columns(0) * sheet.Rows(0);
  std::vector<Gram> grams(vertices, Gram::Zero());
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(vertices, 3);
  for (const FitPoint& p : target.points) {
    const Stencil s = sheet.StencilAt(0, p.uv);
    const Eigen::Map<const Eigen::Matrix<double, 16, 1>> w(s.weight.data());
    grams[s.index[0]].noalias() += w * w.transpose();
    for (int k = 0; k < 16; ++k) {
      right.row(s.index[k]) += w[k] * p.position.transpose();
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (int patch = 0; patch < kPatches * kPatches; ++patch) {
    const std::array<int, 16> index = grid.PatchVertices(patch % kPatches, patch / kPatches);
    for (int k = 0; k < 256; ++k) {
      const int row = index[k % 16], column = index[k / 16];
      if (row >= column) {
        entries.emplace_back(row, column, grams[index[0]](k % 16, k / 16));
      }
    }
  }
  Matrix normal(vertices, vertices);
  normal.setFromTriplets(entries.begin(), entries.end());
  Eigen::CholmodSupernodalLLT<Matrix, Eigen::Lower> factor;
  factor.setShift(1e-8);
  factor.compute(normal);
  const Eigen::MatrixX3d x = factor.solve(right);
  double sum = 0;
  for (const FitPoint& p : target.points) {
    const Stencil s = sheet.StencilAt(0, p.uv);
    Vec3 at = -p.position;
    for (int k = 0; k < 16; ++k) {
      at += s.weight[k] * x.row(s.index[k]).transpose();
    }
    sum += at.squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(target.points.size()));
}

const std::vector<Term> kPointTerm = {PointTerm{}};

double SolveLevel(const HSplineSurface& sheet, const FitTarget& target, Solver solver) {
  return FitLevel(ViewOf(sheet, target), kPointTerm, solver).summary.rms_after_mm;
}

double SolveFit(const HSplineSurface& sheet, const FitTarget& target) {
  return Fit(sheet, target, {},
             {.plan = ListedPlan{.schedule = {{0, 1}}},
              .terms = kPointTerm,
              .solver = Solver::kFastest},
             {})
      .point_rms_mm;
}

using Way = std::function<double(const HSplineSurface&, const FitTarget&)>;

Measured MeasureHere(int count, const Way& way) {
  const HSplineSurface sheet = Sheet();
  const FitTarget target = Points(count);
  const double begin = CpuSecondsSoFar();
  Measured measured;
  measured.rms_mm = way(sheet, target);
  measured.seconds = CpuSecondsSoFar() - begin;
  measured.peak_mb = PeakMb();
  return measured;
}

Measured MeasureWay(int count, const Way& way) {
  return MeasureApart([&] { return MeasureHere(count, way); });
}

}  // namespace

void RunLinear() {
  const Way fit = SolveFit, peer = SolveDirectly;
  const Way level = [](const auto& s, const auto& t) { return SolveLevel(s, t, Solver::kFastest); };
  const Way ceres = [](const auto& s, const auto& t) { return SolveLevel(s, t, Solver::kCeres); };
  const Way none = [](const auto&, const auto&) { return 0.0; };
  constexpr int kMany = 1000000;
  const double data_mb = MeasureWay(kMany, none).peak_mb;
  const Measured direct = MeasureWay(kMany, peer), ours = MeasureWay(kMany, fit);
  const Measured at_level = MeasureWay(kMany, level), by_ceres = MeasureWay(kMany, ceres);
  Print("fit.linear_1e6_vs_direct", ours.seconds, direct.seconds, 0.33, "s");
  Print("fit.level_1e6_vs_direct", at_level.seconds, direct.seconds, 0.33, "s");
  Print("fit.ceres_reduced_1e6_vs_direct", by_ceres.seconds, direct.seconds, kNaN, "s");
  Print("fit.linear_1e6_peak_mb", ours.peak_mb, kNaN, 300, "MB");
  Print("fit.linear_1e6_data_mb", data_mb, kNaN, kNaN, "MB");
  Print("fit.direct_1e6_peak_mb", direct.peak_mb, kNaN, kNaN, "MB");
  Print("fit.linear_1e6_rms", ours.rms_mm, direct.rms_mm, 1 - 1e-6, "mm");
  const Measured few = MeasureWay(kMany / 100, fit), some = MeasureWay(kMany / 10, fit);
  Print("fit.linear_1e4_seconds", few.seconds, kNaN, kNaN, "s");
  Print("fit.linear_1e5_seconds", some.seconds, kNaN, kNaN, "s");
  Print("fit.exponent_N", std::log10(ours.seconds / few.seconds) / 2, kNaN, 1.1, "1");
}

}  // namespace semblance::bench
