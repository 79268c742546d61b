// SPDX-License-Identifier: GPL-3.0-or-later
// Errors that points share: lattices, lines, runs of the file.
#include "fitting/nested/error_structure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/nested/nested_fit.h"
#include "fitting/problem/start_surface.h"
#include "fitting/solve/surface_sigma.h"
#include "surfaces/base/random.h"
#include "tests/testing/point_sets.h"

namespace semblance::fitting {
namespace {

constexpr HSplineShape kShape = {.patches_u = 8, .patches_v = 8, .max_level = 8};

struct Points {
  std::vector<Vec3> positions;
  std::vector<Vec2> uv;

  void Add(const Vec2& at, double z) {
    positions.emplace_back(at.x(), at.y(), z);
    uv.push_back(at);
  }
  NestedPoints Nested() const {
    return DisplacementsFrom(StartSurface(kShape, positions, uv), {positions, uv}, 1);
  }
  NestedFitResult Fit() const {
    return FitNested(StartSurface(kShape, positions, uv), {positions, uv},
                     AutoPlan{.outliers = OutlierRule::kKeep}, {});
  }
};

double Hills(const Vec2& at) {
  return std::sin(5 * at.x() + 1) * std::cos(4 * at.y()) + 0.5 * std::sin(7 * at.y());
}

// The root mean square error of a surface of heights.
double ErrorOf(const HSplineSurface& surface) {
  double sum = 0;
  constexpr int kAcross = 60;
  for (int i = 0; i < kAcross; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const Vec2 at((i + 0.5) / kAcross, (j + 0.5) / kAcross);
      const double off = surface.Point(at).z() - Hills(at);
      sum += off * off;
    }
  }
  return std::sqrt(sum) / kAcross;
}

TEST(ErrorStructure, AStepIsFoundOnlyWhereManyPointsShareTheirHeights) {
  Random random(1);
  std::vector<Vec3> whole, fine, free;
  for (int k = 0; k < 3000; ++k) {
    const double z = random.Uniform(0, 10);
    whole.emplace_back(0, 0, 0.1 * std::round(z / 0.1) + 1e3);
    fine.emplace_back(0, 0, 1e-4 * std::round(z / 1e-4));
    free.emplace_back(0, 0, z);
  }
  EXPECT_NEAR(FindLatticeStep(whole), 0.1, 1e-9);
  EXPECT_EQ(FindLatticeStep(fine), 0);
  EXPECT_EQ(FindLatticeStep(free), 0);
  EXPECT_EQ(FindLatticeStep(std::vector<Vec3>(100, Vec3(1, 2, 3))), 0);
  for (Vec3& p : whole) {
    p.z() = std::round(p.z() / 1000);  // one terrace
  }
  EXPECT_EQ(FindLatticeStep(whole), 0);
}

// Whole numbers: the surface does not follow the steps, and the noise is that of the rounding.
TEST(ErrorStructure, RoundedHeightsAreNotFollowed) {
  Random random(2);
  Points rounded;
  constexpr double kStep = 0.125;
  for (int k = 0; k < 20000; ++k) {
    const Vec2 at(random.Uniform(0, 1), random.Uniform(0, 1));
    rounded.Add(at, kStep * std::round(Hills(at) / kStep));
  }
  const NestedFitResult fit = rounded.Fit();
  EXPECT_NEAR(fit.report.lattice_mm, kStep, 1e-9);
  EXPECT_GT(fit.report.noise_mm, 0.95 * kStep / std::sqrt(12));
  EXPECT_LT(ErrorOf(fit.surface), 0.25 * kStep / std::sqrt(12));
}

// Many points and few steps: errors of rounding follow the surface, so they are smaller than those
// of independent heights, and a surface with residuals of step / sqrt(12) is too smooth.
TEST(ErrorStructure, CoarselyRoundedHeightsAreNotSmoothedTooMuch) {
  Random random(7);
  Points rounded;
  constexpr double kStep = 0.25;
  for (int k = 0; k < 100000; ++k) {
    const Vec2 at(random.Uniform(0, 1), random.Uniform(0, 1));
    rounded.Add(at, kStep * std::round((Hills(at) + 0.001 * random.Normal()) / kStep));
  }
  EXPECT_LT(ErrorOf(rounded.Fit().surface), 0.25 * kStep / std::sqrt(12));
}

// Points of contours have few heights, which are exact.
TEST(ErrorStructure, ContoursLieAlongLines) {
  Random random(3);
  Points contours, scattered;
  for (int k = 0; k < 4000; ++k) {
    const double angle = random.Uniform(0, 2 * std::numbers::pi), ring = 1 + k % 6;
    const Vec2 at(0.5 + 0.08 * ring * std::cos(angle), 0.5 + 0.08 * ring * std::sin(angle));
    contours.Add(at, ring);
    scattered.Add({random.Uniform(0, 1), random.Uniform(0, 1)}, ring);
  }
  EXPECT_TRUE(LieAlongLines(contours.Nested()));
  EXPECT_FALSE(LieAlongLines(scattered.Nested()));
}

// Scan lines in the order of the file, each `drift` off.
Points ScanLines(double drift) {
  Random random(4);
  Points lines;
  for (int line = 0; line < 80; ++line) {
    const double off = drift * random.Normal();
    for (int k = 0; k < 100; ++k) {
      const Vec2 at((k + 0.5) / 100, (line + 0.5) / 80);
      lines.Add(at, Hills(at) + off + 0.005 * random.Normal());
    }
  }
  return lines;
}

TEST(ErrorStructure, RunsAreThoseOfTheFile) {
  Points lines = ScanLines(0);
  const NestedPoints nested = lines.Nested();
  const FileRuns runs = FindFileRuns(nested);
  ASSERT_EQ(runs.count, 80u);
  for (std::size_t k = 0; k < nested.size(); ++k) {
    EXPECT_EQ(runs.run[k], nested.given[k] / 100);
  }
  Random random(5);
  Points shuffled;
  for (int k = 0; k < 5000; ++k) {
    shuffled.Add({random.Uniform(0, 1), random.Uniform(0, 1)}, 0.1 * random.Normal());
  }
  EXPECT_EQ(FindFileRuns(shuffled.Nested()).count, 0u);
}

// Lines without drift are as good as independent points.
TEST(ErrorStructure, LinesThatDoNotDriftCountInFull) {
  const AutoReport report = ScanLines(0).Fit().report;
  EXPECT_GT(report.effective_share, 0.7);
  EXPECT_EQ(report.runs, 0);
}

// The design effect of blocks that share a part of their error, by its definition.
TEST(ErrorStructure, TheDesignEffectCountsSharedErrors) {
  Random random(6);
  const FileRuns none;
  DesignEffect independent(none), shared(none);
  double of_block = 0;
  for (std::size_t k = 0; k < 64 * 400; ++k) {
    of_block = k % 64 == 0 ? random.Normal() : of_block;
    independent.Add(k, {{random.Normal(), 0, 0}});
    shared.Add(k, {{of_block + random.Normal(), 0, 0}});
  }
  EXPECT_NEAR(independent.Value(), 1, 0.3);
  EXPECT_NEAR(shared.Value(), (64 + 1) / 2.0, 6);  // (m s^2 + n^2) / (s^2 + n^2) with m = 64
}

// Errors that the points of a run share, as those of a scanner's lines.
TEST(ErrorStructure, TheDesignEffectCountsSharedErrorsOfRuns) {
  constexpr std::uint32_t kRuns = 300, kPerRun = 40;
  Random random(8);
  FileRuns runs{.run = {}, .count = kRuns};
  std::vector<double> of_run;
  for (std::uint32_t k = 0; k < kRuns * kPerRun; ++k) {
    runs.run.push_back(k % kRuns);  // neighbours on the curve are of different runs
    of_run.push_back(random.Normal());
  }
  DesignEffect effect(runs);
  for (std::uint32_t k = 0; k < kRuns * kPerRun; ++k) {
    effect.Add(k, {{of_run[k % kRuns] + random.Normal(), 0, 0}});
  }
  EXPECT_NEAR(effect.Value(), (kPerRun + 1) / 2.0, 4);
}

// A random field of variance 1 by Bochner's theorem: waves whose numbers have the spectrum of the
// covariance exp(-h / length), or of exp(-h^2 / (2 length^2)).
class CorrelatedErrors {
 public:
  CorrelatedErrors(double length, bool is_rough, std::uint64_t random_seed) {
    Random random(random_seed);
    for (Wave& wave : waves_) {
      const double spread = is_rough ? std::abs(random.Normal()) : 1;
      wave.number = Vec2(random.Normal(), random.Normal()) / (length * spread);
      wave.phase = random.Uniform(0, 2 * std::numbers::pi);
    }
  }
  double operator()(const Vec2& at) const {
    double sum = 0;
    for (const Wave& wave : waves_) {
      sum += std::cos(wave.number.dot(at) + wave.phase);
    }
    return sum * std::sqrt(2.0 / static_cast<double>(waves_.size()));
  }

 private:
  struct Wave {
    Vec2 number;
    double phase;
  };
  std::array<Wave, 500> waves_;
};

// The share of the true surface within 1.645 standard deviations, which should be 90 %.
double CoverageOf(const NestedFitResult& fit, const Points& points) {
  const AutoReport& report = fit.report;
  const SurfaceSigma sigma(
      fit.surface, {.uv = points.uv, .weights = {}, .columns = {}}, {},
      {.noise_mm = report.noise_mm / std::sqrt(report.effective_share),
       .weight = report.weight,
       .stretch = report.stretch,
       .direction_deg = report.direction_deg,
       .lengths_mm = MeanLengths(StartSurface(kShape, points.positions, points.uv))});
  constexpr int kAcross = 60;
  std::vector<Vec2> places;
  for (int k = 0; k < kAcross * kAcross; ++k) {
    places.emplace_back((k % kAcross + 0.5) / kAcross, (k / kAcross + 0.5) / kAcross);
  }
  const std::vector<double> sd = sigma.At(places);
  int within = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const double off = fit.surface.Point(places[k]).z() - Hills(places[k]);
    within += std::abs(off) < 1.645 * sd[k] ? 1 : 0;
  }
  return within / static_cast<double>(places.size());
}

// A surface that follows the lines is as far off as they are; the mean of all 80 is a ninth of it.
TEST(ErrorStructure, OffsetsOfLinesAreNotFollowed) {
  constexpr double kDrift = 0.05;
  const Points lines = ScanLines(kDrift);
  const NestedFitResult fit = lines.Fit();
  EXPECT_EQ(fit.report.runs, 80);
  EXPECT_NEAR(fit.report.run_offset_mm, kDrift, 0.3 * kDrift);
  EXPECT_NEAR(fit.report.noise_mm, kDrift, 0.3 * kDrift);  // of which the offsets are nearly all
  EXPECT_LT(ErrorOf(fit.surface), 0.6 * kDrift);
  EXPECT_GT(CoverageOf(fit, lines), 0.7);
  double sum = 0;
  for (std::size_t k = 0; k < lines.uv.size(); ++k) {
    const double off = fit.surface.Point(lines.uv[k]).z() - lines.positions[k].z();
    EXPECT_NEAR(fit.residual_mm[k], std::abs(off), 1e-9);  // of the points as given
    sum += off * off;
  }
  EXPECT_NEAR(fit.rms_mm, std::sqrt(sum / static_cast<double>(lines.uv.size())), 1e-9);
}

// Ridges along the lines, five lines to each, are the surface.
TEST(ErrorStructure, RidgesAlongLinesAreNoOffsets) {
  Random random(14);
  Points lines;
  for (int k = 0; k < 8000; ++k) {
    const Vec2 at((k % 100 + 0.5) / 100, (k / 100 + 0.5) / 80);
    lines.Add(at, 0.05 * std::sin(2 * std::numbers::pi * 16 * at.y()) + 0.1 * Hills(at) +
                      1e-3 * random.Normal());
  }
  EXPECT_EQ(lines.Fit().report.runs, 0);
}

// Rough ground along lines differs from line to line, but not along the whole of them.
TEST(ErrorStructure, RoughGroundAlongLinesIsNoOffset) {
  const testing::Fractal ground;
  Points lines;
  for (int k = 0; k < 8000; ++k) {
    const Vec2 at((k % 100 + 0.5) / 100, (k / 100 + 0.5) / 80);
    lines.Add(at, ground(at));
  }
  ASSERT_EQ(FindFileRuns(lines.Nested()).count, 80u);
  EXPECT_EQ(lines.Fit().report.runs, 0);
}

TEST(ErrorStructure, ErrorsOfNeighboursAreNotFollowed) {
  constexpr int kPoints = 10000;
  struct Case {
    bool is_rough;
    double noise;  // 0.06 is a thirteenth of the heights' standard deviation
  };
  const std::vector<Case> cases = {{false, 5e-3}, {true, 5e-3}, {false, 0.06}};
  double coverage = 0;
  for (const auto& [is_rough, noise] : cases) {
    const CorrelatedErrors errors(0.02, is_rough, 9);
    Random random(10);
    Points points;
    for (int k = 0; k < kPoints; ++k) {
      const Vec2 at(random.Uniform(0, 1), random.Uniform(0, 1));
      points.Add(at, Hills(at) + noise * errors(at));
    }
    const NestedFitResult fit = points.Fit();
    EXPECT_LT(ErrorOf(fit.surface), 0.75 * noise);  // 0.85 to 1 if the errors are followed
    EXPECT_LT(fit.report.effective_share, 0.3);
    coverage += CoverageOf(fit, points) / static_cast<double>(cases.size());
  }
  EXPECT_GT(coverage, 0.8);
  EXPECT_LT(coverage, 0.98);
}

// Detail without such a sign stays: rough everywhere, or fine in a part of the domain.
TEST(ErrorStructure, DetailDoesNotCountAsErrorsOfNeighbours) {
  for (const auto& height : {std::function<double(const Vec2&)>(testing::Fractal()),
                             std::function<double(const Vec2&)>(testing::DetailHeight),
                             std::function<double(const Vec2&)>(testing::Creases)}) {
    Random random(11);
    Points points;
    for (int k = 0; k < 10000; ++k) {
      const Vec2 at(random.Uniform(0, 1), random.Uniform(0, 1));
      points.Add(at, height(at) + 5e-4 * random.Normal());
    }
    EXPECT_GT(points.Fit().report.effective_share, 0.7);
  }
}

TEST(ErrorStructure, OutliersStandTogetherOnARidge) {
  Random random(7);
  std::vector<char> alone(20000, 0), ridge(20000, 0);
  for (int k = 0; k < 400; ++k) {
    alone[static_cast<std::size_t>(random.Uniform(0, 19999))] = 1;
    ridge[static_cast<std::size_t>(2 * k + 5000)] = 1;
  }
  EXPECT_FALSE(StandTogether(alone));
  EXPECT_TRUE(StandTogether(ridge));
  EXPECT_FALSE(StandTogether(std::vector<char>(100, 0)));
}

}  // namespace
}  // namespace semblance::fitting
