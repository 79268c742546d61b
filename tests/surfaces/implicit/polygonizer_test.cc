// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/polygonizer.h"

#include <gtest/gtest.h>

#include <limits>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/implicit_face.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::SphereMesh;

// A ball with bumps, open at the bottom, and depths from 2 to 4 mm.
struct Skull {
  TriMesh mesh;
  std::vector<double> depth_mm;
};

Skull BumpySkull() {
  Skull skull;
  const TriMesh sphere = SphereMesh({0, 0, 0}, 1, 8);
  std::vector<bool> keep;
  for (const Triangle& t : sphere.triangles) {
    keep.push_back(TriangleCentroid(sphere, t).z() > -0.8);
  }
  skull.mesh = Submesh(sphere, keep);
  for (Vec3& p : skull.mesh.points) {
    skull.depth_mm.push_back(11 + 3 * std::sin(3 * p.x() + 2 * p.z()));  // thick for coarse cells
    p *= 30 + 3 * std::cos(5 * p.y()) * std::sin(4 * p.x());
  }
  return skull;
}

ImplicitFaceOptions Options(const Emitter& emitter, const Polygonizer& polygonizer,
                            EdgeSearch method, double tail_error, int resolution = 16) {
  return {.field = {emitter, tail_error},
          .resolution = resolution,
          .polygonizer = polygonizer,
          .edges = {.method = method},
          .target_triangles = 1000000};
}

ImplicitFace Face(const ImplicitFaceOptions& options) {
  const Skull skull = BumpySkull();
  return BuildImplicitFace(skull.mesh, skull.depth_mm, options, {});
}

const std::vector<Emitter> kEmitters = {FlatEmitter{},
                                        FlatEmitter{3},
                                        FlatEmitter{6, EmitterDepth::kLinear},
                                        SplitEmitter{},
                                        ThesisEmitter{},
                                        ThesisEmitter{.cut_below = 0.002},
                                        SplitEmitter{.cut_below = 0.002}};
const std::vector<Polygonizer> kFaster = {
    NarrowBand{},
    NarrowBand{FollowedComponents::kAll},
    McOctree{},
    McOctree{.sums = ListSums::kLanes},
    MinMaxOctree{},
    MinMaxOctree{.least_emission = 0.05},
    MinMaxOctree{.minimum = EmitterMinimum::kCachedCorners},
    MinMaxOctree{.minimum = EmitterMinimum::kCorners, .sums = ListSums::kLanes}};

class Agreement : public ::testing::TestWithParam<Emitter> {};
INSTANTIATE_TEST_SUITE_P(All, Agreement, ::testing::ValuesIn(kEmitters));

TEST_P(Agreement, AllGiveTheBruteForceMeshToTheBit) {
  constexpr int kCoarse = 11;  // boxes still split twice; brute force is slow
  for (const EdgeSearch method : {EdgeSearch::kBisection, EdgeSearch::kRegulaFalsi}) {
    const double tail_error = method == EdgeSearch::kBisection ? 0 : 1e-3;
    const ImplicitFace brute = Face(Options(GetParam(), BruteForce{}, method, tail_error, kCoarse));
    EXPECT_GT(brute.dense.triangles.size(), 300u);
    for (const Polygonizer& polygonizer : kFaster) {
      const ImplicitFace other =
          Face(Options(GetParam(), polygonizer, method, tail_error, kCoarse));
      EXPECT_EQ(other.dense.points, brute.dense.points) << polygonizer.index();
      EXPECT_EQ(other.dense.triangles, brute.dense.triangles) << polygonizer.index();
    }
  }
}

TEST(Polygonizer, EachOptimisationOfTheThesisSavesEvaluations) {
  const auto counts = [](const Polygonizer& polygonizer) {
    return Face(Options(ThesisEmitter{.cut_below = 0.002}, polygonizer, EdgeSearch::kBisection, 0))
        .counts;
  };
  const PolygonizeSummary brute = counts(BruteForce{}), boxes = counts(McOctree{}),
                          bounds = counts(MinMaxOctree{.least_emission = 0.002}),
                          band = counts(NarrowBand{});
  EXPECT_LT(boxes.corner_evaluations, brute.corner_evaluations);
  EXPECT_LT(bounds.corner_evaluations, boxes.corner_evaluations / 2);
  EXPECT_LT(bounds.emitter_evaluations, boxes.emitter_evaluations);
  EXPECT_LT(band.corner_evaluations, bounds.corner_evaluations);
  EXPECT_EQ(brute.bound_evaluations, 0);
  EXPECT_GT(bounds.bound_evaluations, 0);
}

// Thesis 3.2.3. The minimum at corners is never below the ball's bound, so that no more boxes are
// visited.
TEST(Polygonizer, TheThesissEmitterCacheSavesEvaluationsAndChangesNoBit) {
  const auto face = [](EmitterMinimum minimum) {
    const MinMaxOctree octree{.least_emission = 0.002, .minimum = minimum};
    ImplicitFaceOptions options =
        Options(SplitEmitter{.cut_below = 0.002}, octree, EdgeSearch::kBisection, 0);
    options.edges.tolerance = 0.5;  // corners, not edges, are counted
    return Face(options);
  };
  const ImplicitFace ball = face(EmitterMinimum::kBall), corners = face(EmitterMinimum::kCorners),
                     cached = face(EmitterMinimum::kCachedCorners);
  EXPECT_EQ(cached.dense.points, ball.dense.points);
  EXPECT_EQ(cached.dense.triangles, ball.dense.triangles);
  EXPECT_EQ(cached.dense.points, corners.dense.points);
  EXPECT_EQ(cached.counts.bound_evaluations, corners.counts.bound_evaluations);
  EXPECT_LE(cached.counts.bound_evaluations, ball.counts.bound_evaluations);
  EXPECT_EQ(cached.counts.corner_evaluations, corners.counts.corner_evaluations);
  EXPECT_LT(cached.counts.emitter_evaluations, 0.8 * double(corners.counts.emitter_evaluations));
}

TEST(Polygonizer, RefusesAnInvalidGrid) {
  const Skull skull = BumpySkull();
  const ImplicitSurface surface(skull.mesh, skull.depth_mm, {});
  for (const Polygonizer& polygonizer : kFaster) {
    EXPECT_THROW(PolygonizeSurface(polygonizer, surface, SampleGrid{}, {}, {}, {}), InputError);
  }
}

// Two distant balls, one of them within a closed shell: four components.
TEST_P(Agreement, NoComponentIsMissedIfAllAreRequested) {
  TriMesh mesh;
  for (const TriMesh& part : {SphereMesh({0, 0, 0}, 20, 14), SphereMesh({0, 0, 0}, 3, 6),
                              SphereMesh({45, 5, 3}, 6, 8), SphereMesh({1, 44, -9}, 1.5, 6)}) {
    const auto offset = static_cast<std::int32_t>(mesh.points.size());
    const bool inward = part.points.size() == SphereMesh({0, 0, 0}, 20, 14).points.size();
    mesh.points.insert(mesh.points.end(), part.points.begin(), part.points.end());
    for (const Triangle& t : part.triangles) {
      mesh.triangles.push_back(inward ? Triangle{t[0] + offset, t[2] + offset, t[1] + offset}
                                      : Triangle{t[0] + offset, t[1] + offset, t[2] + offset});
    }
  }
  const ImplicitSurface surface(mesh, std::vector<double>(mesh.points.size(), 2.5),
                                {GetParam(), 1e-3});
  const SampleGrid grid{Vec3(-34.3, -34.1, -33.2), Vec3::Constant(1.7), {57, 55, 40}};
  const PolygonizeResult brute = PolygonizeSurface(BruteForce{}, surface, grid, {}, {}, {}),
                         all = PolygonizeSurface(NarrowBand{FollowedComponents::kAll}, surface,
                                                 grid, {}, {}, {});
  EXPECT_GE(ConnectedComponents(brute.mesh).count, 4);
  EXPECT_EQ(all.mesh.points, brute.mesh.points);
  EXPECT_EQ(all.mesh.triangles, brute.mesh.triangles);
  EXPECT_LT(all.summary.corner_evaluations, brute.summary.corner_evaluations / 2);
}

class Bounds : public ::testing::TestWithParam<Emitter> {
 protected:
  // A triangle with a depth, and boxes of all sizes around it.
  void Check(const TriMesh& triangle, double depth_mm, const Box3& box, Random& random) {
    const std::vector<double> depths = {0.97 * depth_mm, depth_mm, 1.03 * depth_mm};
    const ImplicitSurface surface(triangle, depths, {GetParam(), 0});
    ASSERT_EQ(surface.EmitterCount(), 1);
    const std::int32_t only = 0;
    EmissionBounds bounds;
    surface.BoundsIn(box, {&only, 1}, {&bounds, 1});
    at_corner_ += bounds.least_at_corner ? 1 : 0;
    double least_at_corner = std::numeric_limits<double>::infinity();
    for (int c = 0; c < 8; ++c) {
      const Vec3 corner = box.corner(static_cast<Box3::CornerType>(c));
      least_at_corner = std::min(least_at_corner, surface.SumEmissions({&only, 1}, corner));
    }
    for (int n = 0; n < 200; ++n) {
      const Vec3 share = random.InBox(-0.2, 1.2).cwiseMax(0).cwiseMin(1);  // corners and faces too
      const Vec3 p = box.min() + share.cwiseProduct(box.sizes());
      const double emission = surface.SumEmissions({&only, 1}, p);
      EXPECT_LE(bounds.least, emission) << p.transpose();
      EXPECT_GE(bounds.most, emission) << p.transpose();
      if (bounds.least_at_corner) {
        EXPECT_LE((1 - surface.SumShare() - 1e-9) * least_at_corner, emission) << p.transpose();
      }
    }
  }

  int at_corner_ = 0;  // boxes with the minimum at a corner
};
INSTANTIATE_TEST_SUITE_P(All, Bounds, ::testing::ValuesIn(kEmitters));
INSTANTIATE_TEST_SUITE_P(Broken, Bounds, ::testing::Values(Emitter(FlatEmitter{4.5})));

TEST_P(Bounds, HoldEverywhereInABox) {
  Random random(11);
  for (int n = 0; n < 400; ++n) {
    TriMesh triangle{{}, {{0, 1, 2}}};
    for (int c = 0; c < 3; ++c) {
      triangle.points.push_back(random.InBox(-4, 4));
    }
    const Vec3 low = random.InBox(-15, 15);
    const double size = std::exp(random.Uniform(-2, 3));
    Check(triangle, random.Uniform(2, 9),
          {low, low + size * (Vec3::Ones() + 0.5 * random.InBox(0, 1))}, random);
  }
  EXPECT_GT(at_corner_, 20);
}

// The thesis's maximum, at the closest point of the box, is 0 here.
TEST_P(Bounds, HoldWhereTheClosestPointOfTheBoxIsBehindTheTriangle) {
  Random random(12);
  const TriMesh triangle{{{0.1, 0, -0.1}, {0, 0.1, 0}, {-0.1, -0.1, 0.1}}, {{0, 1, 2}}};
  ASSERT_GT(TriangleAreaVector(triangle, {0, 1, 2}).x(), 0);
  Check(triangle, 4, {Vec3(-3, -0.5, 0.5), Vec3(-1, 0.5, 3)}, random);
}

// All corners of the box are beyond the moved triangle or in its prism; between them the emission
// is 0 beside the prism.
TEST_P(Bounds, HoldBesideAPrism) {
  Random random(13);
  const TriMesh triangle{{{0, 0, 0}, {10, 0, 0}, {0, 10, 0}}, {{0, 1, 2}}};
  Check(triangle, 4, {Vec3(-1, -1, 0.5), Vec3(12, 12, 3)}, random);
  Check(triangle, 4, {Vec3(1, 1, 1), Vec3(2, 2, 2.5)}, random);
}

}  // namespace
}  // namespace semblance::surfaces
