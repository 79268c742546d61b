// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/head_formula.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace semblance::problems {
namespace {

constexpr int kSteps = 240;
const Vec3 kInside(0, 95, -30);  // on the axis of the head, level with the nose

double At(int step) { return static_cast<double>(step) / kSteps; }

Vec3 AreaVector(double u, double v) {
  constexpr double h = 1e-5;
  return (HeadPoint(u + h, v) - HeadPoint(u - h, v))
      .cross(HeadPoint(u, v + h) - HeadPoint(u, v - h));
}

template <class Visitor>
void ForDenseGrid(const Visitor& visit) {
  for (int j = 0; j <= kSteps; ++j) {
    for (int i = 0; i <= kSteps; ++i) {
      visit(At(i), At(j));
    }
  }
}

std::vector<Vec3> MidlineProfile() {
  std::vector<Vec3> profile;
  for (int j = 0; j <= 4000; ++j) {
    profile.push_back(HeadPoint(0.5, j / 4000.0));
  }
  return profile;
}

// The profile's most forward point with z in [from, to].
Vec3 MostForward(double from, double to) {
  Vec3 best(0, 1e9, 0);
  for (const Vec3& p : MidlineProfile()) {
    if (p.z() >= from && p.z() <= to && p.y() < best.y()) {
      best = p;
    }
  }
  return best;
}

Vec3 MostHollow(double from, double to) {
  Vec3 best(0, -1e9, 0);
  for (const Vec3& p : MidlineProfile()) {
    if (p.z() >= from && p.z() <= to && p.y() > best.y()) {
      best = p;
    }
  }
  return best;
}

// Full width of the face between two heights.
double Width(double from, double to) {
  double half = 0;
  ForDenseGrid([&](double u, double v) {
    const Vec3 p = HeadPoint(u, v);
    if (p.z() >= from && p.z() <= to) {
      half = std::max(half, p.x());
    }
  });
  return 2 * half;
}

TEST(HeadFormula, IsMirrorSymmetric) {
  ForDenseGrid([](double u, double v) {
    const Vec3 p = HeadPoint(u, v), q = HeadPoint(1 - u, v);
    ASSERT_LT((p - Vec3(-q.x(), q.y(), q.z())).norm(), 1e-9) << u << " " << v;
  });
}

TEST(HeadFormula, NormalsPointOutwardEverywhereSoThereIsNoFold) {
  ForDenseGrid([](double u, double v) {
    const Vec3 outward = (HeadPoint(u, v) - kInside).normalized();
    ASSERT_GT(AreaVector(u, v).normalized().dot(outward), 0.1) << u << " " << v;
  });
}

TEST(HeadFormula, RunsFromTheRightToTheLeftAndFromBelowToAbove) {
  EXPECT_LT(HeadPoint(0.2, 0.6).x(), 0);
  EXPECT_GT(HeadPoint(0.8, 0.6).x(), 0);
  EXPECT_LT(HeadPoint(0.5, 0.2).z(), HeadPoint(0.5, 0.8).z());
  EXPECT_LT(HeadPoint(0.5, 0.6).y(), HeadPoint(0.2, 0.6).y());
}

TEST(HeadFormula, ReachesBehindTheEarsUnderTheChinAndOverTheForehead) {
  EXPECT_GT(HeadPoint(0, 0.6).y(), 105);
  EXPECT_GT(HeadPoint(1, 0.6).y(), 105);
  EXPECT_GT(HeadPoint(0.5, 0).y(), 40);
  EXPECT_LT(AreaVector(0.5, 0.04).normalized().z(), -0.9);
  EXPECT_GT(HeadPoint(0.5, 1).z(), 80);
}

TEST(HeadFormula, HasTheProportionsOfAnAdultFace) {
  const Vec3 tip = MostForward(-50, -30);
  const Vec3 nasion = MostHollow(-8, 8);
  const auto profile = MidlineProfile();
  const double menton =
      std::min_element(profile.begin(), profile.end(), [](const Vec3& a, const Vec3& b) {
        return a.z() < b.z();
      })->z();
  EXPECT_NEAR(nasion.norm(), 0, 5);
  EXPECT_NEAR(nasion.z() - menton, 120, 6);
  EXPECT_NEAR((tip - nasion).norm(), 50, 6);
  EXPECT_NEAR(nasion.y() - tip.y(), 27, 5);
  EXPECT_NEAR(Width(-40, 0), 141, 5);
  EXPECT_NEAR(Width(10, 60), 148, 8);
  EXPECT_NEAR(Width(-90, -80), 118, 8);
}

TEST(HeadFormula, ProfileHasItsHillsAndHollows) {
  const double glabella = MostForward(8, 25).y(), nasion = MostHollow(-8, 8).y();
  const double under_nose = MostHollow(-66, -54).y(), upper = MostForward(-72, -66).y();
  const double mouth = MostHollow(-78, -72).y(), lower = MostForward(-86, -78).y();
  const double fold = MostHollow(-98, -86).y(), chin = MostForward(-112, -100).y();
  EXPECT_LT(glabella + 2.5, nasion);
  EXPECT_LT(upper + 2, under_nose);
  EXPECT_LT(upper + 2, mouth);
  EXPECT_LT(lower + 2, mouth);
  EXPECT_LT(lower + 4, fold);
  EXPECT_LT(chin + 2.5, fold);
}

TEST(HeadFormula, PatchesAreEvenWithinAFactorOfFive) {
  constexpr int kPatches = 32, kCells = 5;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (int j = 0; j < kPatches; ++j) {
    for (int i = 0; i < kPatches; ++i) {
      double area = 0;
      for (int cell = 0; cell < kCells * kCells; ++cell) {
        area += AreaVector((i + (cell % kCells + 0.5) / kCells) / kPatches,
                           (j + (cell / kCells + 0.5) / kCells) / kPatches)
                    .norm();
      }
      least = std::min(least, area);
      most = std::max(most, area);
    }
  }
  EXPECT_LT(most / least, 5);
}

// A slope that changes by 1 mm per unit at a kink gives a second difference of 1 / h = 1e4 there
// and next to nothing beside it.
TEST(HeadFormula, HasNoKinkAcrossTheMidlineNorAlongIt) {
  constexpr double h = 1e-4;
  const auto second = [](const Vec2& at, const Vec2& d) -> Vec3 {
    const auto point = [](const Vec2& uv) { return HeadPoint(uv.x(), uv.y()); };
    return (point(at + d) - 2 * point(at) + point(at - d)) / (h * h);
  };
  for (int j = 1; j < 400; ++j) {
    const Vec2 at(0.5, j / 400.0);
    for (const Vec2& d : {Vec2(h, 0), Vec2(0, h)}) {
      const Vec3 mean = (second(at - 2 * d, d) + second(at + 2 * d, d)) / 2;
      ASSERT_LT((second(at, d) - mean).norm(), 1e3) << at.transpose();
    }
  }
}

}  // namespace
}  // namespace semblance::problems
