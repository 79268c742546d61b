// SPDX-License-Identifier: GPL-3.0-or-later
// Measures whether the stated uncertainty of an adaptive fit is correct.
#pragma once

#include <cmath>
#include <vector>

#include "fitting/fit.h"
#include "fitting/uncertainty/error_propagation.h"
#include "tests/testing/scattered_data.h"

namespace semblance::testing {
using namespace problems;

// Fits a field with a bump to 1,100 points with noise in z (sixteen per finest patch). Returns the
// share of grid points at which the fitted surface lies within the 90 % interval of the true one,
// averaged over `draws`.
inline double AdaptiveCoverage(double tolerance_over_noise, int draws) {
  constexpr double kNoise_mm = 0.01, kNinety = 1.6449;
  constexpr int kCount = 1100, kSide = 24;
  const HSplineShape shape{.patches_u = 4, .patches_v = 4, .max_level = 1};
  const auto bump = [](const Vec2& uv) {
    return Vec3(uv.x(), uv.y(), 0.1 * std::exp(-(uv - Vec2(0.7, 0.3)).squaredNorm() / 0.05));
  };
  std::vector<Vec2> grid;
  for (int k = 0; k < kSide * kSide; ++k) {
    grid.emplace_back((k % kSide + 0.5) / kSide, (k / kSide + 0.5) / kSide);
  }
  const HSplineSurface rest = PlainStart(shape);
  const std::vector<Term> terms = {PointTerm{}};
  const AdaptivePlan plan{.tolerance_mm = tolerance_over_noise * kNoise_mm, .finest = 1};
  const PointErrors errors{std::vector<Vec3>(kCount, Vec3::UnitZ()),
                           kNoise_mm * Eigen::MatrixXd::Identity(kCount, kCount)};
  int held = 0;
  for (int draw = 0; draw < draws; ++draw) {
    FitTarget target = Scattered(bump, kCount, 0, 100 + draw);
    Random random(500 + draw);
    for (FitPoint& p : target.points) {
      p.position.z() += kNoise_mm * random.Normal();
    }
    const HSplineSurface surface =
        Fit(rest, target, {}, {.plan = plan, .terms = terms, .solver = Solver::kFastest}, {})
            .surface;
    const int level = surface.Offsets(1).empty() ? 0 : 1;
    const std::vector<double> sigma =
        ErrorPropagation(surface, rest, target, level, terms, errors)
            .Sigma(grid, std::vector<Vec3>(grid.size(), Vec3::UnitZ()));
    for (std::size_t k = 0; k < grid.size(); ++k) {
      const double off = surface.Point(grid[k]).z() - bump(grid[k]).z();
      held += std::abs(off) <= kNinety * sigma[k] ? 1 : 0;
    }
  }
  return held / static_cast<double>(draws * static_cast<int>(grid.size()));
}

}  // namespace semblance::testing
