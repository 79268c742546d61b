// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/import_ct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "problems/io/volumes/volume_surface.h"
#include "surfaces/marching/polygonize.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/ct_phantom.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using testing::CtPhantom;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::WordsOf;

double LargestDistanceFromBall(const TriMesh& mesh, const Vec3& centre, double radius_mm) {
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

TEST_F(ImportCtTest, TheSkinHasNoAirwaysAndNoHolder) {
  const CtImport import = ImportCt(volume_, {}, {});
  int in_nostril = 0;
  for (const Vec3& p : import.skin.points) {
    const double off = (p - head_.centre).norm() - head_.skin_mm;
    EXPECT_LT(off, 1) << p.transpose();  // the holder is removed
    in_nostril += off < -2 ? 1 : 0;
  }
  // Only the plug of the nostril is off the ball.
  EXPECT_LT(in_nostril, static_cast<int>(import.skin.points.size() / 50));
  EXPECT_EQ(ConnectedComponents(import.skin).count, 1);
}

TEST_F(ImportCtTest, WithoutALimitNarrowOpeningsAreFollowed) {
  CtImportOptions options;
  options.widest_opening_mm = 0;
  double deepest = 0;
  for (const Vec3& p : ImportCt(volume_, options, {}).skin.points) {
    deepest = std::max(deepest, head_.skin_mm - (p - head_.centre).norm());
  }
  EXPECT_GT(deepest, 20);  // through the nostril to the sinus
}

TEST_F(ImportCtTest, TheSkullHasItsInnerSideAndNoSpeck) {
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

// The table may be close to the side of the volume.
TEST_F(ImportCtTest, AHolderAtTheSideOfTheVolumeIsNotTheHead) {
  CtVolume cut = volume_;
  cut.rows -= 3;  // the holder ends 2 mm from the side
  cut.values.clear();
  for (int k = 0; k < cut.slices; ++k) {
    const auto slice = volume_.values.begin() + static_cast<std::ptrdiff_t>(volume_.Index(0, 0, k));
    cut.values.insert(cut.values.end(), slice,
                      slice + static_cast<std::ptrdiff_t>(cut.Index(0, 0, 1)));
  }
  for (const Vec3& p : ImportCt(cut, {}, {}).skin.points) {
    ASSERT_LT((p - head_.centre).norm(), head_.skin_mm + 1) << p.transpose();
  }
}

TEST_F(ImportCtTest, DroppedObjectsAreNoted) {
  const CtImport import = ImportCt(volume_, {}, {});
  EXPECT_THAT(import.notes,
              Contains(AllOf(HasSubstr("1 of at least 1 cm^3"), HasSubstr("; 1 smaller"))));
  EXPECT_THAT(import.notes, Not(Contains(HasSubstr("metal"))));
}

// The same head at another place, turned and with a tilted gantry, gives the same voxels.
TEST_F(ImportCtTest, SurfacesFollowTheAxesOfTheVolume) {
  CtVolume moved = volume_;
  moved.origin = Vec3(-300, 200, -900);
  moved.axes.col(0) = Vec3(1, 0.1, 0).normalized();
  moved.axes.col(1) = Vec3(-0.1, 1, 0).normalized();
  moved.axes.col(2) = Vec3(0, -0.3, 1).normalized();
  const CtImport still = ImportCt(volume_, {}, {}), import = ImportCt(moved, {}, {});
  ASSERT_EQ(import.skin.triangles, still.skin.triangles);
  ASSERT_EQ(import.skull.points.size(), still.skull.points.size());
  for (std::size_t v = 0; v < import.skull.points.size(); ++v) {
    const Vec3 a = volume_.VoxelAt(still.skull.points[v]),
               b = moved.VoxelAt(import.skull.points[v]);
    ASSERT_LT((a - b).norm(), 1e-4) << v;
  }
}

// A filling between the two sides of the bone, and a bright streak across the brain.
TEST_F(ImportCtTest, StreaksOfMetalAreRemovedFromTheBone) {
  const Vec3 metal = head_.centre + Vec3(0, -36, 0);
  CtVolume streaked = volume_;
  const int slice = static_cast<int>(std::lround(metal.z() / 1.5));
  for (int k = slice - 1; k <= slice + 1; ++k) {
    for (int j = 0; j < streaked.rows; ++j) {
      for (int i = 0; i < streaked.columns; ++i) {
        const Vec3 p = streaked.World(i, j, k);
        std::int16_t& value = streaked.values[streaked.Index(i, j, k)];
        const double r = (p - metal).norm(), aside = std::abs(p.x() - metal.x());
        const bool in_brain = (p - head_.centre).norm() < head_.brain_mm - 3;
        value = r < 3 ? std::int16_t{12000} : value;
        value = in_brain && aside < 0.5 && k == slice ? std::int16_t{700} : value;
      }
    }
  }
  const auto deepest = [&](const CtImportOptions& options) {
    double least = 1e9;
    for (const Vec3& p : ImportCt(streaked, options, {}).skull.points) {
      least = std::min(least, (p - head_.centre).norm());
    }
    return least;
  };
  CtImportOptions keep;
  keep.smallest_bone_cm2 = 0;
  CtImportOptions take = keep;
  keep.thinnest_bone_mm = 0;
  take.thinnest_bone_mm = 4;  // with voxels of 1.5 mm
  EXPECT_LT(deepest(keep), 5);
  EXPECT_GT(deepest(take), 15);
  EXPECT_THAT(ImportCt(streaked, take, {}).notes, Contains(HasSubstr("metal: 1 pieces")));
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
  EXPECT_THAT(half.notes, Contains(HasSubstr("edges at half maximum")));
}

TEST_F(ImportCtTest, ThreadsDoNotChangeTheResult) {
  RunContext two;
  two.threads = 2;
  CtImportOptions options;
  options.edges = CtEdges::kHalfMaximum;
  const CtImport a = ImportCt(volume_, options, {}), b = ImportCt(volume_, options, two);
  EXPECT_EQ(a.skull.points, b.skull.points);
  EXPECT_EQ(a.skin.points, b.skin.points);
  EXPECT_EQ(a.skin.triangles, b.skin.triangles);
}

TEST_F(ImportCtTest, AVolumeWithoutAHeadIsAClearError) {
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

// The header alone gives the unit of a volume; subject.units applies to meshes.
TEST_F(ImportCtTest, AVolumeTooSmallForAHeadIsRefusedWithARemedy) {
  const auto to_do = HasSubstr(
      "it looks like centimetres; multiply spacing and origin in the "
      "volume's header by 10");
  CtVolume small = volume_;
  small.spacing_mm = Vec3(0.3, 0.3, 0.3);
  EXPECT_THAT(WordsOf<InputError>([&] { ImportCt(small, {}, {}); }),
              AllOf(HasSubstr("import-ct: the volume: its longest side is 24.3 mm"), to_do));
  EXPECT_THAT(WordsOf<InputError>([&] { ImportMrSkin(small, {}, {}); }), to_do);
  const CtVolume aside = CtPhantom{.skin_mm = 16, .bone_mm = 13, .brain_mm = 8}.Make();
  EXPECT_THAT(WordsOf<InputError>([&] { ImportCt(aside, {}, {}); }),
              AllOf(HasSubstr("import-ct: the skull: its longest side is 26"), to_do));
}

// An evenly blurred edge crosses half its height at the edge, whatever the threshold was.
TEST_F(ImportCtTest, HalfMaximumFindsTheEdgeOfABlurredBall) {
  TriMesh ball = testing::SphereMesh(head_.centre + Vec3(0, 0, 0), head_.skin_mm + 0.4, 60);
  std::vector<bool> keep;
  for (const Triangle& t : ball.triangles) {
    const Vec3 c = TriangleCentroid(ball, t);  // away from cut, holder and nostril
    keep.push_back(c.z() > 25 && c.y() < -30 && c.z() < 70);
  }
  ball = Submesh(ball, keep);
  EXPECT_NEAR(MoveToHalfMaximum(volume_, {}, {}, ball), -0.4, 0.1);
  EXPECT_LT(LargestDistanceFromBall(ball, head_.centre, head_.skin_mm), 0.2);
}

// An edge stays where the mean of a voxel is midway, so the balls keep their size within a part of
// the coarser voxels.
TEST_F(ImportCtTest, ACoarserImportKeepsTheEdgesAndIsNoted) {
  const CtImport import =
      ImportCt(volume_, {.skin_hu = -480, .coarsen = {.pixel_mm = 3, .slice_mm = 3}}, {});
  EXPECT_THAT(import.notes, Contains(HasSubstr("3 x 3 x 3 mm instead of 1.5 x 1.5 x 1.5 mm")));
  int off = 0;
  for (const Vec3& p : import.skin.points) {
    off += std::abs((p - head_.centre).norm() - head_.skin_mm) > 1 ? 1 : 0;
  }
  EXPECT_LT(off, static_cast<int>(import.skin.points.size() / 20));  // the plug of the nostril
}

}  // namespace
}  // namespace semblance::problems
