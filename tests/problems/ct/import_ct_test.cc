// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/ct/import_ct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/ct/half_maximum_edge.h"
#include "surfaces/marching/polygonize.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/ct_phantom.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance {
namespace {

using testing::CtPhantom;
using ::testing::HasSubstr;
using testing::WordsOf;

double FurthestFromBall(const TriMesh& mesh, const Vec3& centre, double radius_mm) {
  double furthest = 0;
  for (const Vec3& p : mesh.points) {
    furthest = std::max(furthest, std::abs((p - centre).norm() - radius_mm));
  }
  return furthest;
}

class ImportCtTest : public ::testing::Test {
 protected:
  CtPhantom head_;
  CtVolume volume_ = head_.Make();
};

TEST_F(ImportCtTest, SkinIsTheOutsideAloneWithoutAirwaysOrHolder) {
  const CtImport import = ImportCt(volume_, {}, {});
  int in_nostril = 0;
  for (const Vec3& p : import.skin.points) {
    const double off = (p - head_.centre).norm() - head_.skin_mm;
    EXPECT_LT(off, 1) << p.transpose();  // the holder is gone
    in_nostril += off < -2 ? 1 : 0;
  }
  // Only the plug of the nostril is not on the ball.
  EXPECT_LT(in_nostril, static_cast<int>(import.skin.points.size() / 50));
  EXPECT_EQ(ConnectedComponents(import.skin).count, 1);
}

TEST_F(ImportCtTest, NarrowOpeningsAreFollowedIfAskedTo) {
  CtImportOptions options;
  options.widest_opening_mm = 0;
  double deepest = 0;
  for (const Vec3& p : ImportCt(volume_, options, {}).skin.points) {
    deepest = std::max(deepest, head_.skin_mm - (p - head_.centre).norm());
  }
  EXPECT_GT(deepest, 20);  // through the nostril to the sinus
}

TEST_F(ImportCtTest, SkullHasItsInnerSideAndNoSpeck) {
  const CtImport import = ImportCt(volume_, {}, {});
  bool inner = false;
  for (const Vec3& p : import.skull.points) {
    const double r = (p - head_.centre).norm();
    EXPECT_LT(r, head_.bone_mm + 1.2);
    inner = inner || r < head_.brain_mm + 1;
  }
  EXPECT_TRUE(inner);
  EXPECT_GE(import.dropped_bone, 0);
}

TEST_F(ImportCtTest, MeshesAreOutwardAndOpenOnlyAtTheCut) {
  const CtImport import = ImportCt(volume_, {}, {});
  for (const TriMesh* mesh : {&import.skull, &import.skin}) {
    const EdgeReport edges = CheckEdges(*mesh);
    EXPECT_EQ(edges.non_manifold, 0);
    EXPECT_EQ(edges.inconsistent, 0);
    EXPECT_GT(edges.boundary, 0);
    std::map<std::pair<int, int>, int> uses;
    for (const Triangle& t : mesh->triangles) {
      for (int c = 0; c < 3; ++c) {
        ++uses[std::minmax(t[c], t[(c + 1) % 3])];
      }
    }
    for (const auto& [edge, count] : uses) {
      if (count == 1) {
        EXPECT_EQ(mesh->points[edge.first].z(), 0);
      }
    }
  }
  int outward = 0, all = 0;
  for (const Triangle& t : import.skin.triangles) {
    const Vec3 centroid = TriangleCentroid(import.skin, t);
    outward += TriangleAreaVector(import.skin, t).dot(centroid - head_.centre) > 0 ? 1 : 0;
    ++all;
  }
  EXPECT_GT(outward, 0.98 * all);
}

TEST_F(ImportCtTest, ThresholdsThinTissueAndHalfMaximumDoesNot) {
  const CtImport fixed = ImportCt(volume_, {}, {});
  CtImportOptions options;
  options.edges = CtEdges::kHalfMaximum;
  const CtImport half = ImportCt(volume_, options, {});
  const Vec3 up = Vec3(1, 2, 3).normalized();
  const auto tissue = [&](const CtImport& import) {
    const Vec3 far = head_.centre + 80 * up;
    return MeshQuery(import.skull).FirstHit(far, -up, 100)->distance_mm -
           MeshQuery(import.skin).FirstHit(far, -up, 100)->distance_mm;
  };
  EXPECT_NEAR(tissue(half), head_.skin_mm - head_.bone_mm, 0.15);
  EXPECT_LT(tissue(fixed), tissue(half) - 0.1);
  EXPECT_LT(half.skull_move_mm, 0);
  ASSERT_EQ(half.notes.size(), 1u);
}

TEST_F(ImportCtTest, ThreadsChangeNoBit) {
  RunContext two;
  two.threads = 2;
  CtImportOptions options;
  options.edges = CtEdges::kHalfMaximum;
  const CtImport a = ImportCt(volume_, options, {}), b = ImportCt(volume_, options, two);
  EXPECT_EQ(a.skull.points, b.skull.points);
  EXPECT_EQ(a.skin.points, b.skin.points);
  EXPECT_EQ(a.skin.triangles, b.skin.triangles);
}

TEST_F(ImportCtTest, VolumesWithoutAHeadAreOneClearError) {
  CtVolume air = volume_;
  std::fill(air.values.begin(), air.values.end(), -1000);
  EXPECT_THAT(WordsOf<InputError>([&] { ImportCt(air, {}, {}); }),
              HasSubstr("no tissue above -200 HU"));
  CtVolume soft = volume_;
  for (std::int16_t& value : soft.values) {
    value = std::min<std::int16_t>(value, 100);
  }
  EXPECT_THAT(WordsOf<InputError>([&] { ImportCt(soft, {}, {}); }), HasSubstr("no bone at 226 HU"));
  CtVolume full = volume_;
  std::fill(full.values.begin(), full.values.end(), 40);
  EXPECT_THAT(WordsOf<InputError>([&] { ImportCt(full, {}, {}); }),
              HasSubstr("no air below -200 HU"));
}

// A slope blurred evenly crosses half its height where its edge is, wherever the threshold was.
TEST_F(ImportCtTest, HalfMaximumFindsTheEdgeOfABlurredBall) {
  TriMesh ball = testing::SphereMesh(head_.centre + Vec3(0, 0, 0), head_.skin_mm + 0.4, 60);
  std::vector<bool> keep;
  for (const Triangle& t : ball.triangles) {
    const Vec3 c = TriangleCentroid(ball, t);  // away from cut, holder and nostril
    keep.push_back(c.z() > 25 && c.y() < -30 && c.z() < 70);
  }
  ball = Submesh(ball, keep);
  EXPECT_NEAR(MoveToHalfMaximum(volume_, {}, {}, ball), -0.4, 0.1);
  EXPECT_LT(FurthestFromBall(ball, head_.centre, head_.skin_mm), 0.2);
}

}  // namespace
}  // namespace semblance
