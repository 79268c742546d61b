// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit_face.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/skull_fill.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Joined;
using testing::Plate;
using testing::SphereMesh;

void ExpectClosedManifold(const TriMesh& mesh) {
  const EdgeReport edges = CheckEdges(mesh);
  EXPECT_EQ(edges.boundary, 0);
  EXPECT_EQ(edges.non_manifold, 0);
  EXPECT_EQ(edges.inconsistent, 0);
  EXPECT_GT(SignedVolume(mesh), 0);
}

TEST(ImplicitFace, OverASphereItIsASphereClosedAndManifold) {
  const TriMesh sphere = SphereMesh({3, 2, 1}, 80, 40);
  const ImplicitFace face = BuildImplicitFace(sphere, std::vector<double>(sphere.points.size(), 8),
                                              {.resolution = 60, .target_triangles = 2000}, {});
  ExpectClosedManifold(face.dense);
  ExpectClosedManifold(face.mesh);
  EXPECT_LE(face.mesh.triangles.size(), 2000u);
  for (const Vec3& p : face.dense.points) {
    EXPECT_NEAR((p - Vec3(3, 2, 1)).norm(), 88, 0.6);
  }
  EXPECT_TRUE(face.notes.empty());
  EXPECT_GT(face.counts.corner_evaluations, 0);
}

// Without the solid inside, most corners of the grid would miss the layer of tissue.
TEST(ImplicitFace, TissueMuchThinnerThanACellMakesOneSheetWithoutHolesThorough) {
  const TriMesh sphere = SphereMesh({3, 2, 1}, 80, 40);
  for (const Emitter& emitter : {Emitter(FlatEmitter{}), Emitter(ThesisEmitter{.decay = 15})}) {
    const ImplicitFace face =
        BuildImplicitFace(sphere, std::vector<double>(sphere.points.size(), 0.5),
                          {.field = {.emitter = emitter}, .resolution = 30}, {});
    ExpectClosedManifold(face.dense);
    EXPECT_GT(face.cell_mm, 1);
    EXPECT_EQ(ConnectedComponents(face.dense).count, 1);
    EXPECT_NEAR(SignedVolume(face.dense), 4.0 / 3 * std::numbers::pi * std::pow(80.5, 3),
                0.02 * SignedVolume(face.dense));
    const auto euler = std::ssize(face.dense.points) - CheckEdges(face.dense).edges +
                       std::ssize(face.dense.triangles);
    EXPECT_EQ(euler, 2);  // a sphere's: no tunnels
  }
}

TEST(ImplicitFace, OverAnOpenShellThinTissueRaisesTheResolution) {
  const TriMesh plate = Plate(60, 20);
  const ImplicitFace face = BuildImplicitFace(plate, std::vector<double>(plate.points.size(), 1.5),
                                              {.resolution = 20}, {});
  ExpectClosedManifold(face.dense);
  EXPECT_LT(face.cell_mm, 0.76 * 1.5);
  ASSERT_FALSE(face.notes.empty());
  EXPECT_NE(face.notes[0].find("raised from 20"), std::string::npos) << face.notes[0];
}

TEST(ImplicitFace, ThreadsChangeNoBit) {
  const TriMesh sphere = SphereMesh({3, 2, 1}, 80, 20);
  const std::vector<double> depth(sphere.points.size(), 8);
  RunContext two;
  two.threads = 2;
  const ImplicitFace a = BuildImplicitFace(sphere, depth, {.resolution = 40}, {}),
                     b = BuildImplicitFace(sphere, depth, {.resolution = 40}, two);
  EXPECT_EQ(a.dense.points, b.dense.points);
  EXPECT_EQ(a.mesh.points, b.mesh.points);
  EXPECT_EQ(a.mesh.triangles, b.mesh.triangles);
}

TEST(ImplicitFace, AFarOutThesisSurfaceStillFitsAndItsDensityIsReported) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 60, 40);
  ImplicitFaceOptions options{.resolution = 40};
  options.field.emitter = ThesisEmitter{};
  options.field.tail_error = 1e-2;
  const ImplicitFace face =
      BuildImplicitFace(sphere, std::vector<double>(sphere.points.size(), 10), options, {});
  ExpectClosedManifold(face.dense);
  EXPECT_GT((face.dense.points[0]).norm(), 72);
  ASSERT_EQ(face.notes.size(), 1u);
  EXPECT_NE(face.notes[0].find("emitter density"), std::string::npos);
}

TEST(ImplicitFace, AnOpenShellStillGivesAClosedFace) {
  const TriMesh plate = Plate(60, 20);
  const ImplicitFace face =
      BuildImplicitFace(plate, std::vector<double>(plate.points.size(), 6), {.resolution = 60}, {});
  ExpectClosedManifold(face.dense);
}

TEST(ImplicitFace, OpenEndsKeepWhatLiesOverTheShellAlone) {
  const TriMesh plate = Plate(60, 20);  // 0 to 60 each way, facing +z
  const ImplicitFace face =
      BuildImplicitFace(plate, std::vector<double>(plate.points.size(), 6),
                        {.resolution = 60, .ends = FaceEnds::kOpen, .target_triangles = 500}, {});
  for (const TriMesh* mesh : {&face.dense, &face.mesh}) {
    const EdgeReport edges = CheckEdges(*mesh);
    EXPECT_GT(edges.boundary, 0);
    EXPECT_EQ(edges.non_manifold, 0);
    EXPECT_EQ(edges.inconsistent, 0);
    EXPECT_EQ(ConnectedComponents(*mesh).count, 1);
    const Box3 box = Bounds(*mesh);
    EXPECT_GT(box.min().z(), 3);
    EXPECT_LT(box.max().z(), 6.2);
    EXPECT_NEAR(box.min().x(), 0, 2);
    EXPECT_NEAR(box.max().y(), 60, 2);
    for (const Triangle& t : mesh->triangles) {
      EXPECT_GT(TriangleAreaVector(*mesh, t).z(), 0);
    }
  }
}

// Half of a sphere has a depth; and where all of a closed shell has, nothing ends.
TEST(ImplicitFace, OpenEndsFollowWhereTheDepthIsKnown) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 40, 24);
  std::vector<double> all(sphere.points.size(), 6), half = all;
  for (std::size_t v = 0; v < half.size(); ++v) {
    half[v] = sphere.points[v].z() > -1 ? half[v] : kNaN;
  }
  const ImplicitFaceOptions closed{.resolution = 40},
      open{.resolution = 40, .ends = FaceEnds::kOpen};
  EXPECT_EQ(BuildImplicitFace(sphere, all, open, {}).dense.triangles,
            BuildImplicitFace(sphere, all, closed, {}).dense.triangles);
  const TriMesh dome = BuildImplicitFace(sphere, half, open, {}).dense;
  EXPECT_GT(CheckEdges(dome).boundary, 0);
  for (const Vec3& p : dome.points) {
    EXPECT_GT(p.norm(), 42);
    EXPECT_GT(p.z(), -5);
  }
  ExpectClosedManifold(BuildImplicitFace(sphere, half, closed, {}).dense);
}

TEST(ImplicitFace, ProjectedVerticesLieOnTheSurface) {
  const TriMesh sphere = SphereMesh({3, 2, 1}, 80, 20);
  std::vector<double> depth;
  for (const Vec3& p : sphere.points) {
    depth.push_back(8 + 2 * std::sin(0.05 * p.x()));
  }
  const ImplicitSurface surface(sphere, depth, {});
  const auto rms = [&](bool project) {
    const ImplicitFace face = BuildImplicitFace(
        sphere, depth, {.resolution = 50, .target_triangles = 1500, .project = project}, {});
    ExpectClosedManifold(face.mesh);
    double sum = 0;
    for (const Vec3& p : face.mesh.points) {
      sum += std::pow(8 * surface.Flattened(p), 2);  // about mm
    }
    return std::sqrt(sum / static_cast<double>(face.mesh.points.size()));
  };
  EXPECT_LT(rms(true), 0.005);
  EXPECT_GT(rms(false), 0.02);
}

TEST(ImplicitFace, ATolerancePrevailsOverTheTarget) {
  const TriMesh sphere = SphereMesh({3, 2, 1}, 80, 20);
  const std::vector<double> depth(sphere.points.size(), 8);
  const ImplicitFace face = BuildImplicitFace(
      sphere, depth, {.resolution = 50, .target_triangles = 100, .tolerance_mm = 0.3}, {});
  ExpectClosedManifold(face.mesh);
  EXPECT_GT(face.mesh.triangles.size(), 300u);
  EXPECT_EQ(face.decimation.stop, DecimateStop::kTolerance);
  const MeshQuery query(face.mesh);
  for (const Vec3& p : face.dense.points) {
    EXPECT_LE(query.Closest(p).distance_mm, 0.3);
  }
  ASSERT_EQ(face.notes.size(), 1u);
  EXPECT_NE(face.notes[0].find("the tolerance, 0.3 mm"), std::string::npos) << face.notes[0];
}

TEST(KeepOutermost, DropsInnerSheetsAndFragments) {
  TriMesh inner = SphereMesh({0, 0, 0}, 5, 8);
  for (Triangle& t : inner.triangles) {
    std::swap(t[0], t[1]);  // an inner sheet faces inward
  }
  const TriMesh outer = SphereMesh({0, 0, 0}, 10, 8);
  int dropped = -1;
  const TriMesh kept =
      KeepOutermost(Joined(Joined(inner, outer), SphereMesh({30, 0, 0}, 2, 6)), dropped);
  EXPECT_EQ(dropped, 2);
  EXPECT_EQ(kept.points, outer.points);
  EXPECT_THROW(KeepOutermost(TriMesh{}, dropped), InputError);
}

TEST(SkullFill, BridgesAHoleAndLeavesTheRestOnBone) {
  TriMesh sphere = SphereMesh({0, 0, 0}, 70, 60);
  std::vector<bool> keep;
  for (const Triangle& t : sphere.triangles) {
    keep.push_back(TriangleCentroid(sphere, t).z() < 69);  // a hole of about 23 mm at the top
  }
  const TriMesh holed = Submesh(sphere, keep);
  const TriMesh shell = FillSkull(holed, WrapFill{.alpha_mm = 30}, {});
  ExpectClosedManifold(shell);
  for (const Vec3& p : shell.points) {
    EXPECT_NEAR(p.norm(), 70, p.z() < 65 ? 0.3 : 3) << p.transpose();
  }
  EXPECT_EQ(FillSkull(holed, NoFill{}, {}).points, holed.points);
}

}  // namespace
}  // namespace semblance::surfaces
