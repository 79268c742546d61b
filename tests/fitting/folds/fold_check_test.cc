// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/folds/fold_check.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "surfaces/base/random.h"
#include "tests/testing/point_sets.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/shapes.h"

namespace semblance::fitting {
namespace {

constexpr double kNone = 0.01;

struct Cloud {
  std::vector<Vec3> positions;
  std::vector<Vec2> at;
  double period_mm = 0;

  MapFaults Faults() const { return FaultsOfPoints({positions, at, period_mm}); }
};

// Points of a surface, seen from above.
Cloud FromAbove(const std::function<Vec3(const Vec2&)>& surface, int count, double noise = 0) {
  Cloud cloud;
  for (const FitPoint& p : testing::Scattered(surface, count, noise, 1).points) {
    cloud.positions.push_back(p.position);
    cloud.at.emplace_back(p.position.x(), p.position.y());
  }
  return cloud;
}

Vec3 OnSphere(const Vec2& uv) {
  const double z = 2 * uv.y() - 1, r = std::sqrt(1 - z * z), p = 2 * std::numbers::pi * uv.x();
  return {r * std::cos(p), r * std::sin(p), z};
}

TEST(FoldCheck, HeightFieldsDoNotFoldHoweverSteepNoisyOrMany) {
  for (const double steep : {1.0, 5.0}) {
    const auto field = [&](const Vec2& uv) -> Vec3 {
      const Vec3 p = testing::FrankePoint(uv);
      return {p.x(), p.y(), steep * p.z()};
    };
    for (const int count : {300, 5000, 40000}) {
      EXPECT_LT(FromAbove(field, count).Faults().Sum(), kNone) << steep << ", " << count;
    }
  }
  EXPECT_LT(FromAbove(testing::FrankePoint, 5000, /*noise=*/0.05).Faults().Sum(), kNone);
  EXPECT_LT(FromAbove(testing::FrankePoint, 40000, /*noise=*/0.03).Faults().Sum(), kNone);
}

// Every point set of the benchmarks, as it is scattered: crowded, with outliers, with gaps.
TEST(FoldCheck, NoneOfTheHeightFieldsOfTheBenchFolds) {
  for (const testing::PointSet& set : testing::PointSets()) {
    if (set.closure == Closure::kOpen) {
      Random random(7);
      Cloud cloud;
      for (int k = 0; k < 20000; ++k) {
        const Vec2 uv = set.place(random);
        Vec3 p = set.truth(uv) + Vec3(0, 0, set.noise * random.Normal());
        p.z() += random.Uniform() < set.outliers ? random.Uniform(set.gross[0], set.gross[1]) : 0;
        cloud.positions.push_back(p);
        cloud.at.emplace_back(p.x(), p.y());
      }
      EXPECT_LT(cloud.Faults().Sum(), kNone) << set.name;
    }
  }
}

TEST(FoldCheck, ASphereSeenFromAboveFolds) {
  for (const int count : {400, 5000, 60000}) {
    EXPECT_GT(FromAbove(OnSphere, count).Faults().folded, 0.3) << count;
  }
}

// Two terraces with nothing between them are not two sheets over each other.
TEST(FoldCheck, ACliffIsNoFold) {
  const auto terraces = [](const Vec2& uv) -> Vec3 {
    return {uv.x(), uv.y(), uv.x() + 0.3 * std::sin(4 * uv.y()) > 0.6 ? 0.5 : 0};
  };
  EXPECT_LT(FromAbove(terraces, 5000).Faults().Sum(), 0.01);
}

// The tube is one-to-one around its axis, also across the seam; its flat lids are not.
TEST(FoldCheck, LidsCollapseOnACylinder) {
  const auto around = [](bool lids) {
    Random random(1);
    Cloud cloud{.positions = {}, .at = {}, .period_mm = 2 * std::numbers::pi};
    for (int k = 0; k < 20000; ++k) {
      const bool lid = lids && k % 3 == 0;
      const double turn = 2 * std::numbers::pi * random.Uniform(), place = random.Uniform();
      const double r = lid ? std::sqrt(place) : 1, z = lid ? 2.0 * (k % 2) : 2 * place;
      cloud.positions.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
      cloud.at.emplace_back(turn, z);
    }
    return cloud.Faults();
  };
  EXPECT_LT(around(false).Sum(), kNone);
  EXPECT_GT(around(true).Sum(), 0.15);
}

// 0.4 of a sheet is folded back over the rest.
TEST(FoldCheck, TrianglesGiveTheShareThatIsTurnedOver) {
  const TriMesh mesh =
      testing::GridMesh([](const Vec2& uv) { return Vec3(uv.x(), uv.y(), 0); }, 20);
  std::vector<Vec2> at;
  for (const Vec3& p : mesh.points) {
    at.emplace_back(p.x() <= 0.6 ? p.x() : 1.2 - p.x(), p.y());
  }
  const MapFaults faults = FaultsOfTriangles({mesh.points, at}, mesh.triangles);
  EXPECT_NEAR(faults.folded, 0.4, 1e-12);
  EXPECT_EQ(faults.collapsed, 0);
  EXPECT_FALSE(faults.mirrored);
  for (Vec2& p : at) {
    p.y() *= -1;
  }
  EXPECT_TRUE(FaultsOfTriangles({mesh.points, at}, mesh.triangles).mirrored);
}

// The corners of the triangles are off by a third of an edge and more. A fold of four tenths of the
// sheet is still found.
TEST(FoldCheck, TrianglesThatNoiseTurnsAreNoFold) {
  TriMesh mesh = testing::GridMesh([](const Vec2& uv) { return Vec3(uv.x(), uv.y(), 0); }, 60);
  Random random(3);
  std::vector<Vec2> above, folded;
  for (Vec3& p : mesh.points) {
    folded.emplace_back(p.x() <= 0.6 ? p.x() : 1.2 - p.x(), p.y());
    p += 0.35 / 60 * Vec3(random.Normal(), random.Normal(), random.Normal());
    above.emplace_back(p.x(), p.y());
  }
  EXPECT_GT(FaultsOfTriangles({mesh.points, above}, mesh.triangles).folded, 0.02);
  EXPECT_LT(FaultsBeyondNoise({mesh.points, above}, mesh.triangles).Sum(), 1e-3);
  EXPECT_NEAR(FaultsBeyondNoise({mesh.points, folded}, mesh.triangles).folded, 0.4, 0.02);
}

// A tube that bends leaves its axis: a few points of the near side then spread widely over many of
// the far side.
TEST(FoldCheck, ATubeThatBendsAwayFromItsAxisFoldsAroundIt) {
  const auto bent = [](double bend, int count) {
    Random random(1);
    Cloud cloud{.positions = {}, .at = {}, .period_mm = 0.6 * std::numbers::pi};
    for (int k = 0; k < count; ++k) {
      const double turn = 2 * std::numbers::pi * random.Uniform(), along = 2 * random.Uniform() - 1,
                   angle = bend / 2 * along, r = 2 / bend + 0.15 * std::cos(turn);
      const Vec3 p(r * std::cos(angle) - 2 / bend + bend / 12, 0.15 * std::sin(turn),
                   r * std::sin(angle));
      cloud.positions.push_back(p);
      cloud.at.emplace_back(0.3 * std::atan2(p.y(), p.x()), p.z());
    }
    return cloud.Faults();
  };
  for (const int count : {1500, 10000}) {
    EXPECT_LT(bent(0.2, count).Sum(), kNone) << count;
    EXPECT_GT(bent(1.6, count).folded, 0.02) << count;
    EXPECT_GT(bent(2.5, count).folded, 0.06) << count;
  }
}

// Points spread evenly over one turn and a half of a spiral whose turns are 6.28 apart.
//   noise: standard deviation of each coordinate, in spacings of the points.
std::vector<Vec3> RollPoints(std::size_t count, double noise) {
  constexpr double kFirst = 1.5 * std::numbers::pi, kLast = 4.5 * std::numbers::pi, kWidth = 21;
  const auto length = [](double t) { return (t * std::hypot(1, t) + std::asinh(t)) / 2; };
  const double spacing =
      std::sqrt(kWidth * (length(kLast) - length(kFirst)) / static_cast<double>(count));
  Random random(1);
  std::vector<Vec3> points;
  while (points.size() < count) {
    const double turn = random.Uniform(kFirst, kLast), along = random.Uniform(0, kWidth);
    if (random.Uniform() * std::hypot(1, kLast) <= std::hypot(1, turn)) {
      const Vec3 off(random.Normal(), random.Normal(), random.Normal());
      points.push_back(Vec3(turn * std::cos(turn), along, turn * std::sin(turn)) +
                       noise * spacing * off);
    }
  }
  return points;
}

// With noise of one to three spacings a height field stays one-to-one, and a roll folds.
TEST(FoldCheck, ARollDiffersFromNoiseAsWideAsItsSpacing) {
  for (const int count : {2000, 20000}) {
    for (const double noise : {1.0, 2.0, 3.0}) {
      const double width = noise / std::sqrt(count);
      const auto flat = [](const Vec2& uv) -> Vec3 { return {uv.x(), uv.y(), 0.2 * uv.x()}; };
      EXPECT_LT(FromAbove(flat, count, width).Faults().Sum(), kNone) << count << " " << noise;
    }
  }
  for (const double noise : {0.3, 1.0}) {
    Cloud above, along;
    above.positions = along.positions = RollPoints(20000, noise);
    for (const Vec3& p : above.positions) {
      above.at.emplace_back(p.x(), p.y());
      along.at.emplace_back(p.x(), p.z());
    }
    EXPECT_GT(above.Faults().folded, 0.4) << noise;
    EXPECT_GT(along.Faults().Sum(), 0.02) << noise;
  }
}

// Of heights with outliers on one side or both, most neighbours agree; those of two sheets and of
// solids do not.
TEST(FoldCheck, MostHeightsAgreeBetweenOutliersAlone) {
  const auto scatter = [](const std::function<double(const Vec2&, Random&)>& height) {
    Random random(12);
    Cloud cloud;
    for (int k = 0; k < 5000; ++k) {
      const Vec2 at(random.Uniform(), random.Uniform());
      cloud.positions.emplace_back(height(at, random), 0, 0);
      cloud.at.push_back(at);
    }
    return ScatterOfMostHeights({cloud.positions, cloud.at});
  };
  const auto franke = [](const Vec2& at) { return testing::FrankePoint(at).z(); };
  const auto with_outliers = [&](double low) {
    return [&franke, low](const Vec2& at, Random& random) {
      return franke(at) + (random.Uniform() < 0.3 ? random.Uniform(low, 1) : 0);
    };
  };
  EXPECT_LT(scatter(with_outliers(0.1)), 0.05);
  EXPECT_LT(scatter(with_outliers(-1)), 0.05);
  EXPECT_GT(scatter([&](const Vec2& at, Random& random) {
              return franke(at) + (random.Uniform() < 0.5 ? 1 : 0);
            }),
            0.5);
  EXPECT_GT(scatter([](const Vec2&, Random& random) { return random.Uniform(); }), 0.8);
}

TEST(FoldCheck, AFewPointsShowNoFaults) { EXPECT_EQ(FromAbove(OnSphere, 20).Faults().Sum(), 0); }

}  // namespace
}  // namespace semblance::fitting
