// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/parametrise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/closed_shapes.h"
#include "tests/testing/scattered_data.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;

std::vector<Vec3> FrankePoints(int count) {
  std::vector<Vec3> points;
  for (const FitPoint& p : testing::Scattered(testing::FrankePoint, count, 0, 1).points) {
    points.push_back(p.position);
  }
  return points;
}

// Of 400 points on a cylinder about `axis`, by angle and height.
Vec3 OnCylinder(int k, const Mat3& turn) {
  const double angle = 2 * std::numbers::pi * (k % 20) / 20.0;
  return turn * Vec3(30 * std::cos(angle), 30 * std::sin(angle), 5.0 * (k / 20)) + Vec3(1, 2, 3);
}

TEST(Parametrise, WithoutParametersThePlaneIsTaken) {
  const std::vector<Vec3> points = {{0, 0, 5}, {40, 0, 5}, {40, 10, 5}, {0, 10, 5}};
  const Parametrisation p = Parametrise(points);
  EXPECT_EQ(p.source, ParameterSource::kPlane);
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x() / 40, 1e-12);  // the longer side is u
    EXPECT_NEAR(p.uv[k].y(), points[k].y() / 10, 1e-12);
  }
}

// Steep heights, which do not spread least upwards, over the plane that is asked for.
TEST(Parametrise, APlaneAcrossANormalHasItsHeights) {
  const std::vector<Vec3> points = FrankePoints(2000);
  const Parametrisation p = Parametrise(points, PlaneParameters{.normal = {0, 0, 2}});
  for (std::size_t k = 0; k < p.uv.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x(), 2e-3);  // the points nearly fill the square
    EXPECT_NEAR(p.uv[k].y(), points[k].y(), 2e-3);
  }
}

// However it stands: angles and heights come back, but for where the angle starts and its sense.
TEST(Parametrise, ACylinderFindsItsAxis) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).matrix();
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, turn));
  }
  const Parametrisation p = Parametrise(points, CylinderParameters{});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
  const double up = p.uv[399].y() > p.uv[0].y() ? 1 : -1;
  for (int k = 0; k < 400; ++k) {
    EXPECT_NEAR(p.uv[k].y(), up > 0 ? (k / 20) / 19.0 : 1 - (k / 20) / 19.0, 1e-9);
    const double turned = std::abs(p.uv[k].x() - p.uv[k - k % 20].x()) * 20;
    EXPECT_NEAR(std::min(turned, 20 - turned), std::min(k % 20, 20 - k % 20), 1e-9);
  }
}

// Of a ring with bumps, stretched, turned and off the origin.
std::vector<Vec3> RingPoints(int count, double noise) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, -2, 0.5).normalized()).matrix();
  std::vector<Vec3> points;
  for (const FitPoint& p : testing::Scattered(testing::RingPoint, count, noise, 1).points) {
    points.emplace_back(30 * (turn * p.position) + Vec3(1, 2, 3));
  }
  return points;
}

// By the angles that it was made with, but for where they start and their sense.
TEST(Parametrise, ATorusIsFoundHoweverItLies) {
  const std::vector<Vec3> points = RingPoints(5000, 1e-3);
  const std::vector<FitPoint> made = testing::Scattered(testing::RingPoint, 5000, 1e-3, 1).points;
  for (const Parameters& parameters :
       {Parameters(TorusParameters{}), Parameters(AutoParameters{})}) {
    const Parametrisation p =
        Parametrise({.positions = points, .closure = Closure::kPeriodicUv}, parameters);
    EXPECT_EQ(p.source, ParameterSource::kTorus);
    EXPECT_THAT(p.how, HasSubstr("the torus around ["));
    EXPECT_LT(p.faults.Sum(), 0.01);
    const auto apart = [](double turns) { return std::abs(turns - std::round(turns)); };
    const auto off = [&](std::size_t k, double sense) {
      return apart(p.uv[k].x() - p.uv[0].x() - sense * (made[k].uv.x() - made[0].uv.x()));
    };
    const double sense = off(1, 1) + off(2, 1) + off(3, 1) < 0.1 ? 1 : -1;
    for (std::size_t k = 0; k < points.size(); ++k) {
      EXPECT_LT(off(k, sense), 0.03);
      EXPECT_LT(apart(p.uv[k].y() - sense * made[k].uv.y()), 0.08);
    }
  }
}

// The surface's normal looks as the triangles do, whichever way that is.
TEST(Parametrise, ATorusLooksAsTheTrianglesDo) {
  TriMesh mesh = testing::GridMesh(testing::RingPoint, 60);
  for (const bool inward : {false, true}) {
    for (Triangle& t : mesh.triangles) {
      if (inward) {
        std::swap(t[1], t[2]);
      }
    }
    const Parametrisation p =
        Parametrise(Scan{.positions = mesh.points, .triangles = mesh.triangles}, TorusParameters{});
    const Vec2 lengths_mm = 2 * std::numbers::pi * Vec2(1, 0.4);
    std::vector<Vec2> at;
    for (const Vec2& uv : p.uv) {
      at.push_back(uv.cwiseProduct(lengths_mm));
    }
    const MapFaults faults = FaultsOfTriangles({mesh.points, at, lengths_mm}, mesh.triangles);
    EXPECT_LT(faults.Sum(), 1e-3);
    EXPECT_FALSE(faults.mirrored);
    for (const Vec2& uv : p.uv) {
      EXPECT_TRUE(uv.minCoeff() >= 0 && uv.maxCoeff() <= 1);
    }
  }
}

// Of count points of the sphere, and of a tube that is closed at its ends by flat lids.
std::vector<Vec3> OnSphere(int count) {
  Random random(3);
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    points.push_back(40 * Vec3(random.Normal(), random.Normal(), random.Normal()).normalized());
  }
  return points;
}

std::vector<Vec3> Tin(int count) {
  Random random(3);
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    const double turn = 2 * std::numbers::pi * random.Uniform(), place = random.Uniform();
    const double r = k % 3 == 0 ? 30 * std::sqrt(place) : 30,
                 z = k % 3 == 0 ? 60.0 * (k % 2) : 60 * place;
    points.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
  }
  return points;
}

std::string WordsOf(const Scan& scan, const Parameters& parameters) {
  try {
    Parametrise(scan, parameters);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

// Steep heights spread most upwards: the plane of least squares folds them, that across z does not.
TEST(Parametrise, AFoldedPlaneIsLeftForAnAxis) {
  std::vector<Vec3> points = FrankePoints(4000);
  for (Vec3& p : points) {
    p.z() *= 5;
  }
  const Parametrisation p = Parametrise(points);
  EXPECT_EQ(p.how, "the plane across z");
  EXPECT_LT(p.faults.Sum(), 0.003);
  for (std::size_t k = 0; k < p.uv.size(); ++k) {
    EXPECT_NEAR(p.uv[k].x(), points[k].x(), 2e-3);
  }
}

TEST(Parametrise, WhatFoldsOverEveryPlaneIsRefusedUnlessAccepted) {
  const std::vector<Vec3> sphere = OnSphere(3000);
  for (const Parameters& parameters : {Parameters(AutoParameters{}), Parameters(PlaneParameters{}),
                                       Parameters(PlaneParameters{.normal = {1, 2, 3}})}) {
    const std::string words = WordsOf({.positions = sphere}, parameters);
    EXPECT_THAT(words, HasSubstr("fold over"));
    EXPECT_THAT(words, HasSubstr("parameters: mesh"));
  }
  const Parametrisation accepted = Parametrise(sphere, PlaneParameters{.folds = FoldRule::kAccept});
  EXPECT_GT(accepted.faults.folded, 0.3);
}

// Around its own axis the lids of a tin collapse; around another it can be gone round.
TEST(Parametrise, ACylinderOnWhichLidsCollapseIsRefusedOrLeft) {
  const std::vector<Vec3> tin = Tin(20000);
  const CylinderParameters upright{.axis = {0, 0, 1}};
  EXPECT_THAT(WordsOf({.positions = tin}, upright), HasSubstr("close at its ends"));
  const Parametrisation other = Parametrise(Scan{.positions = tin, .closure = Closure::kPeriodicU});
  EXPECT_EQ(other.source, ParameterSource::kCylinder);
  EXPECT_LT(other.faults.Sum(), 0.02);
  EXPECT_GT(Parametrise(tin, CylinderParameters{.axis = {0, 0, 1}, .folds = FoldRule::kAccept})
                .faults.collapsed,
            0.1);
}

TEST(Parametrise, WhatIsNoTorusIsRefused) {
  Random random(4);
  std::vector<Vec3> tube, cloud, half, plane;
  for (int k = 0; k < 2000; ++k) {
    tube.push_back(OnCylinder(k % 400, Mat3::Identity()));
    cloud.push_back(random.InBox(-10, 10));
    plane.emplace_back(random.Uniform(), 2 * random.Uniform(), 0);
    half.push_back(testing::RingPoint({random.Uniform(), random.Uniform(0, 0.5)}));
  }
  for (const std::vector<Vec3>& points : {OnSphere(2000), Tin(3000), tube, cloud, half, plane}) {
    EXPECT_THAT(WordsOf({.positions = points}, TorusParameters{}),
                ::testing::AnyOf(HasSubstr("the points are not a torus"),
                                 HasSubstr("the points fold over the torus")));
  }
  EXPECT_THAT(WordsOf({.positions = RingPoints(2000, 0)}, TorusParameters{.axis = {1, 0, 0}}),
              HasSubstr("give another axis"));
}

TEST(Parametrise, OfAClosedSurfaceAutoIsTheCylinder) {
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, Mat3::Identity()));
  }
  const Parametrisation p = Parametrise(Scan{.positions = points, .closure = Closure::kPeriodicU});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
}

// A bumpy stone, longest along z, by its directions, each the same way in any pose.
std::vector<Vec3> Stone(int count, const Mat3& turn) {
  Random random(6);
  std::vector<Vec3> points;
  for (int k = 0; k < count; ++k) {
    const Vec3 d = Vec3(random.Normal(), random.Normal(), random.Normal()).normalized();
    const double r = 30 * (1 + 0.1 * std::sin(3 * d.x() + 1) * std::cos(2 * d.y()));
    points.emplace_back(turn * (r * Vec3(d.x(), d.y(), 1.4 * d.z())) + Vec3(1, 2, 3));
  }
  return points;
}

TEST(Parametrise, OfWhatClosesAtBothEndsAutoIsTheSphere) {
  for (const std::vector<Vec3>& points : {OnSphere(3000), Stone(3000, Mat3::Identity())}) {
    const Parametrisation p =
        Parametrise(Scan{.positions = points, .closure = Closure::kPeriodicU});
    EXPECT_EQ(p.source, ParameterSource::kSphere);
    EXPECT_THAT(p.how, HasSubstr("the sphere along ["));
    EXPECT_LT(p.faults.Sum(), 0.003);
    ASSERT_TRUE(p.poles);
    EXPECT_THAT(WordsOf({.positions = points}, CylinderParameters{}),
                HasSubstr("take parameters: sphere"));
  }
}

// Its ends are tips as those of a ball are, but nothing closes them.
TEST(Parametrise, ATubeThatIsCutAslantStaysACylinder) {
  std::vector<Vec3> points;
  for (int k = 0; k < 400; ++k) {
    points.push_back(OnCylinder(k, Mat3::Identity()));
    points.back().z() += 0.7 * points.back().x();
  }
  const Parametrisation p = Parametrise(Scan{.positions = points, .closure = Closure::kPeriodicU});
  EXPECT_EQ(p.source, ParameterSource::kCylinder);
}

// About the axis that is asked for, to rounding: a sphere's own angles.
TEST(Parametrise, ASphereHasAzimuthAndPolarAngle) {
  const std::vector<Vec3> points = OnSphere(1000);
  const Parametrisation p = Parametrise(points, SphereParameters{.axis = {0, 0, 9}});
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_NEAR(p.uv[k].y(), 1 - std::acos(points[k].z() / 40) / std::numbers::pi, 1e-9);
    const double turn = std::atan2(points[k].y(), points[k].x()) -
                        std::atan2(points[0].y(), points[0].x()),
                 off = turn / (2 * std::numbers::pi) - (p.uv[k].x() - p.uv[0].x());
    EXPECT_NEAR(off, std::round(off), 1e-9);
  }
  EXPECT_LT(((*p.poles)[0] - Vec3(0, 0, -40)).norm(), 1e-9);
  EXPECT_LT(((*p.poles)[1] - Vec3(0, 0, 40)).norm(), 1e-9);
}

// But for where the azimuth starts, and which pole is which.
TEST(Parametrise, ASphereIsFoundHoweverItLies) {
  const Mat3 turn = Eigen::AngleAxisd(0.9, Vec3(1, -2, 0.5).normalized()).matrix();
  const Parametrisation upright = Parametrise(Stone(2000, Mat3::Identity()), SphereParameters{}),
                        turned = Parametrise(Stone(2000, turn), SphereParameters{});
  const bool same = std::abs(upright.uv[0].y() - turned.uv[0].y()) < 1e-6;
  for (std::size_t k = 0; k < upright.uv.size(); ++k) {
    const double v = turned.uv[k].y();
    EXPECT_NEAR(upright.uv[k].y(), same ? v : 1 - v, 1e-9);
    const double off = upright.uv[k].x() - upright.uv[0].x() -
                       (same ? 1 : -1) * (turned.uv[k].x() - turned.uv[0].x());
    EXPECT_NEAR(off, std::round(off), 1e-9);
  }
  for (const int pole : {0, 1}) {
    const Vec3 back = turn.transpose() * ((*turned.poles)[same ? pole : 1 - pole] - Vec3(1, 2, 3));
    EXPECT_LT((back + Vec3(1, 2, 3) - (*upright.poles)[pole]).norm(), 1e-7);
  }
}

// A ball of n rings of n points, longest along z, with one vertex at each pole.
TriMesh BallMesh(int n) {
  TriMesh mesh;
  const auto add = [&](double turn, double v) {
    const double a = 2 * std::numbers::pi * turn, t = std::numbers::pi * v;
    mesh.points.emplace_back(10 * std::sin(t) * std::cos(a), 10 * std::sin(t) * std::sin(a),
                             -12 * std::cos(t));
  };
  for (int j = 1; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      add(static_cast<double>(i) / n, static_cast<double>(j) / n);
    }
  }
  const int low = n * (n - 1), high = low + 1;
  add(0, 0);
  add(0, 1);
  for (int i = 0; i < n; ++i) {
    const int next = (i + 1) % n, last = n * (n - 2);
    mesh.triangles.push_back({low, next, i});
    mesh.triangles.push_back({high, last + i, last + next});
    for (int j = 0; j < last; j += n) {
      mesh.triangles.push_back({j + i, j + next, j + n + next});
      mesh.triangles.push_back({j + i, j + n + next, j + n + i});
    }
  }
  return mesh;
}

// The surface's normal looks as the triangles do, and the poles go with v.
TEST(Parametrise, ASphereLooksAsTheTrianglesDo) {
  TriMesh mesh = BallMesh(40);
  for (const bool inward : {false, true}) {
    for (Triangle& t : mesh.triangles) {
      if (inward) {
        std::swap(t[1], t[2]);
      }
    }
    const Parametrisation p = Parametrise(
        Scan{.positions = mesh.points, .triangles = mesh.triangles}, SphereParameters{});
    EXPECT_EQ(p.faults.mirrored, inward);
    const Vec2 lengths_mm = 10 * std::numbers::pi * Vec2(2, 1);
    std::vector<Vec2> at;
    for (const Vec2& uv : p.uv) {
      at.push_back(uv.cwiseProduct(lengths_mm));
    }
    const Vec2 period_mm(lengths_mm.x(), 0);
    const MapFaults faults = FaultsOfTriangles({mesh.points, at, period_mm}, mesh.triangles);
    EXPECT_LT(faults.Sum(), 0.01);
    EXPECT_FALSE(faults.mirrored);
    EXPECT_NEAR(((*p.poles)[1] - (*p.poles)[0]).z(), inward ? -24 : 24, 1e-3);
  }
}

TEST(Parametrise, WhatDoesNotGoAllRoundIsNoSphere) {
  std::vector<Vec3> cap, tube;
  for (const Vec3& p : OnSphere(6000)) {
    if (p.z() < 20) {
      cap.push_back(p);
    }
  }
  for (int k = 0; k < 400; ++k) {
    tube.push_back(OnCylinder(k, Mat3::Identity()));
  }
  const std::vector<Vec3> sheet = FrankePoints(1000);
  for (const std::vector<Vec3>& points : {cap, tube, sheet}) {
    EXPECT_THAT(WordsOf({.positions = points}, SphereParameters{}),
                HasSubstr("do not go all round the centre of the sphere"));
  }
  std::vector<Vec3> flat = sheet;
  for (Vec3& p : flat) {
    p.z() = 0;
  }
  EXPECT_THAT(WordsOf({.positions = flat}, SphereParameters{}),
              ::testing::AnyOf(HasSubstr("no sphere goes near"), HasSubstr("all round")));
  EXPECT_THAT(WordsOf({.positions = tube}, SphereParameters{.axis = {0, kNaN, 1}}),
              HasSubstr("the sphere's axis is not finite"));
}

// A ball with another one in it, and a ring's tube: rays from the centre meet them twice.
TEST(Parametrise, WhatFoldsOverTheSphereIsRefusedUnlessAccepted) {
  std::vector<Vec3> twice = OnSphere(4000);
  for (std::size_t k = 0; k < twice.size(); k += 2) {
    twice[k] *= 0.5;
  }
  const std::string words = WordsOf({.positions = twice}, SphereParameters{});
  EXPECT_THAT(words, HasSubstr("fold over the sphere"));
  EXPECT_THAT(words, HasSubstr("folds: accept"));
  EXPECT_GT(Parametrise(twice, SphereParameters{.folds = FoldRule::kAccept}).faults.folded, 0.3);
  EXPECT_THAT(WordsOf({.positions = RingPoints(4000, 0)}, SphereParameters{}),
              ::testing::AnyOf(HasSubstr("fold over the sphere"), HasSubstr("all round")));
}

// Rays from no centre meet it once: its triangles are laid out on a sphere.
TEST(Parametrise, AClosedMeshThatFoldsOverTheSphereIsLaidOutOnOne) {
  const testing::ClosedShape bean = testing::Bean();
  const TriMesh mesh = testing::MeshOf(bean, 3000, 0);
  Scan scan{.positions = mesh.points, .triangles = mesh.triangles, .closure = Closure::kPeriodicU};
  EXPECT_THAT(WordsOf(scan, SphereParameters{}), HasSubstr("take parameters: mesh"));
  for (const Parameters& parameters :
       {Parameters(AutoParameters{}), Parameters(MeshParameters{})}) {
    const Parametrisation p = Parametrise(scan, parameters);
    EXPECT_EQ(p.source, ParameterSource::kMesh);
    EXPECT_EQ(p.how, "the mesh laid out on the sphere");
    EXPECT_EQ(p.faults.Sum(), 0);
    ASSERT_TRUE(p.poles);
    for (const Vec3& pole : *p.poles) {
      EXPECT_LT((pole - bean.FootOf(pole)).norm(), 1e-3);
    }
  }
  scan.closure = Closure::kOpen;
  EXPECT_THAT(WordsOf(scan, AutoParameters{}), HasSubstr("write closure: periodic_u"));
  EXPECT_THAT(WordsOf(scan, MeshParameters{}), HasSubstr("write closure: periodic_u"));
}

// An ellipsoid with a thin flat lobe on either side, which rays meet at a flat angle.
testing::ClosedShape WithLobes(double length) {
  testing::ClosedShape shape = testing::EllipsoidWithEars();
  for (testing::FieldBump& bump : shape.bumps) {
    const double side = bump.centre.x() < 0 ? -1 : 1,
                 out = (std::abs(bump.centre.x()) - 0.45) / 0.55 * length;
    if (bump.centre.x() != 0) {
      bump.centre = Vec3(side * (0.45 + 0.55 * out), -0.35 * out * out, 0.2);
      bump.width.z() = 0.2 + 0.15 * out;
    }
  }
  return shape;
}

// Of triangles that fold little over the sphere, or leave little room there, and are laid out with
// more; noise that turns triangles is no reason.
TEST(Parametrise, AClosedMeshIsLaidOutWhereTheSphereSqueezesIt) {
  const auto source_of = [](const testing::ClosedShape& shape, double noise) {
    const TriMesh mesh = testing::MeshOf(shape, 4000, noise);
    return Parametrise(Scan{.positions = mesh.points,
                            .triangles = mesh.triangles,
                            .closure = Closure::kPeriodicU})
        .source;
  };
  const testing::ClosedShape stone{.name = "stone",
                                   .bumps = {{.width = Vec3(1, 1.2, 0.9), .height = 2.7}}};
  EXPECT_EQ(source_of(stone, 0), ParameterSource::kSphere);
  EXPECT_EQ(source_of(stone, 0.02), ParameterSource::kSphere);
  EXPECT_EQ(source_of(WithLobes(0.3), 0), ParameterSource::kSphere);
  EXPECT_EQ(source_of(WithLobes(0.65), 0), ParameterSource::kMesh);
  EXPECT_EQ(source_of(WithLobes(0.65), 1e-3), ParameterSource::kMesh);
}

// A wave that breaks along a part of its crest, by one in a hundred of its area, and noisy scans.
TEST(Parametrise, AnOpenMeshIsLaidOutWhereThePlaneSqueezesIt) {
  const auto wave = [](double height) {
    return [=](const Vec2& uv) -> Vec3 {
      const double t = 2 * std::numbers::pi * (2 * uv.x() - 1), q = (uv.y() - 0.5) / 0.2,
                   a = height * std::exp(-q * q);
      return {t - a * std::sin(t), 12 * uv.y(), -a * std::cos(t)};
    };
  };
  const auto source_of = [](const auto& surface, double noise) {
    TriMesh mesh = testing::GridMesh(surface, 80);
    Random random(3);
    for (Vec3& p : mesh.points) {
      p += noise * Vec3(random.Normal(), random.Normal(), random.Normal());
    }
    return Parametrise(Scan{.positions = mesh.points, .triangles = mesh.triangles}).source;
  };
  EXPECT_EQ(source_of(wave(0.8), 0), ParameterSource::kPlane);
  EXPECT_EQ(source_of(wave(1.2), 0), ParameterSource::kMesh);
  EXPECT_EQ(source_of(wave(0.5), 0.05), ParameterSource::kPlane);
}

TEST(Parametrise, AMeshThatIsNotClosedDoesNotGoRound) {
  const TriMesh plate = testing::Plate(10, 8), ring = testing::RingMesh(20);
  EXPECT_THAT(
      WordsOf(
          {.positions = plate.points, .triangles = plate.triangles, .closure = Closure::kPeriodicU},
          MeshParameters{}),
      HasSubstr("write closure: open"));
  EXPECT_THAT(
      WordsOf(
          {.positions = ring.points, .triangles = ring.triangles, .closure = Closure::kPeriodicU},
          AutoParameters{}),
      HasSubstr("parameters: torus"));
}

// Two thirds of a sphere, as a scan: it folds over every plane, and its triangles are laid out. The
// surface's normal looks as theirs do, whichever way that is.
TEST(Parametrise, TrianglesThatFoldAreLaidOut) {
  const auto bowl = [](const Vec2& uv) -> Vec3 {
    const Vec2 q = 2 * uv - Vec2(1, 1);
    const double t = 2 * q.cwiseAbs().maxCoeff(), p = std::atan2(q.y(), q.x());
    return 50 * Vec3(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t));
  };
  TriMesh mesh = testing::GridMesh(bowl, 40);
  for (const bool inward : {false, true}) {
    for (Triangle& t : mesh.triangles) {
      if (inward) {
        std::swap(t[1], t[2]);
      }
    }
    const Parametrisation p =
        Parametrise(Scan{.positions = mesh.points, .triangles = mesh.triangles});
    EXPECT_EQ(p.source, ParameterSource::kMesh);
    const MapFaults faults = FaultsOfTriangles({mesh.points, p.uv}, mesh.triangles);
    EXPECT_EQ(faults.folded, 0);
    EXPECT_FALSE(faults.mirrored);
  }
}

// Heights that a plane serves stay on the plane, looking as the triangles do.
TEST(Parametrise, APlaneLooksAsTheTrianglesDo) {
  TriMesh mesh = testing::GridMesh(
      [](const Vec2& uv) { return Vec3(9 * uv.x(), 4 * uv.y(), std::sin(2 * uv.x())); }, 20);
  for (const bool inward : {false, true}) {
    for (Triangle& t : mesh.triangles) {
      if (inward) {
        std::swap(t[1], t[2]);
      }
    }
    const Parametrisation p =
        Parametrise(Scan{.positions = mesh.points, .triangles = mesh.triangles});
    EXPECT_EQ(p.source, ParameterSource::kPlane);
    EXPECT_FALSE(FaultsOfTriangles({mesh.points, p.uv}, mesh.triangles).mirrored);
  }
}

TEST(Parametrise, TheRangeOfGivenParametersIsMapped) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vec2> uv = {{0, 0}, {9, 0}, {4.5, 9}};
  const GivenParameters given{.u_range = {0, 9}, .v_range = {0, 9}};
  const Parametrisation p = Parametrise(points, given, uv);
  EXPECT_EQ(p.source, ParameterSource::kGiven);
  EXPECT_EQ(p.uv[2], Vec2(0.5, 1));
}

TEST(Parametrise, WrongInputIsNamed) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Vec2> uv = {{0, 0}, {9, 0}, {4.5, 9}};
  const auto message = [](std::span<const Vec3> at, const Parameters& parameters,
                          std::span<const Vec2> given) -> std::string {
    try {
      Parametrise(at, parameters, given);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_THAT(message({}, AutoParameters{}, {}), HasSubstr("there is no point"));
  EXPECT_THAT(message(points, GivenParameters{}, {}), HasSubstr("needs each point's (u,v)"));
  EXPECT_THAT(
      message(points, GivenParameters{}, uv),
      HasSubstr("point 2 has (u,v) = (9, 0), outside [0, 1] x [0, 1]; to take all points, write "
                "parameters: {type: given, u_range: [0, 9], v_range: [0, 9]}"));
  const std::vector<Vec2> lost = {{0, 0}, {9, 0}, {4.5, kNaN}};
  EXPECT_THAT(message(points, GivenParameters{.u_range = {0, 9}}, lost),
              HasSubstr("point 3 has (u,v) = (4.5, nan), which is not finite; give numbers"));
  EXPECT_THAT(message(points, AutoParameters{}, std::span(uv).first(2)),
              HasSubstr("2 pairs (u,v) for 3 points"));
  EXPECT_THAT(message(points, GivenParameters{.u_range = {1, 0}}, uv),
              HasSubstr("range [1, 0] is empty"));
  const std::vector<Vec3> line = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_THAT(message(line, PlaneParameters{}, {}), HasSubstr("lie on a line"));
  std::vector<Vec3> slanted;  // whose moments are of full rank but for rounding
  for (int k = 0; k < 100; ++k) {
    slanted.push_back(k * Vec3(1, 2, 3));
  }
  EXPECT_THAT(message(slanted, AutoParameters{}, {}), HasSubstr("lie on a line"));
  EXPECT_THAT(message(points, MeshParameters{}, {}), HasSubstr("make no open sheet"));
  EXPECT_THAT(WordsOf({.positions = points, .closure = Closure::kPeriodicU}, MeshParameters{}),
              HasSubstr("for open sheets alone"));
  const std::vector<Triangle> triangles = {{0, 1, 3}};
  EXPECT_THAT(WordsOf({.positions = points, .triangles = triangles}, MeshParameters{}),
              HasSubstr("has the corner 3"));
}

}  // namespace
}  // namespace semblance
