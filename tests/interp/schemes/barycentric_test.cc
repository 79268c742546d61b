// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/network_schemes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::DomeScene;
using testing::DowelScene;
using testing::FlatScene;

DepthField FieldOf(const DowelScene& scene, const Barycentric& options = {}) {
  return InterpolateDepth(options, scene.Input(), RunContext{});
}

// One area of equilateral bases in z = 0 with the given directions.
DowelScene OneArea(const std::array<Vec3, 3>& directions) {
  DowelScene scene;
  const char* sites[] = {"sg", "mso_l", "mso_r"};
  for (int k = 0; k < 3; ++k) {
    const double angle = (90 + 120 * k) * std::numbers::pi / 180;
    const Vec3 base(20 * std::cos(angle), 20 * std::sin(angle), 0);
    scene.dowels.push_back({sites[k], base, directions[k].normalized(), 4.0 + 3 * k});
  }
  scene.network.areas = {{0, 1, 2}};
  return scene;
}

Vec3 Weighted(const DowelScene& scene, const Vec3& w) {
  return w[0] * scene.dowels[0].base + w[1] * scene.dowels[1].base + w[2] * scene.dowels[2].base;
}

double WeightedDepth(const DowelScene& scene, const Vec3& w) {
  return w[0] * scene.dowels[0].depth_mm + w[1] * scene.dowels[1].depth_mm +
         w[2] * scene.dowels[2].depth_mm;
}

std::vector<Vec3> RandomWeights(int count, std::uint64_t random_seed) {
  Random random(random_seed);
  std::vector<Vec3> weights(count);
  for (Vec3& w : weights) {
    w = random.InBox(0.02, 1);
    w /= w.sum();
  }
  return weights;
}

TEST(Barycentric, LinearDepthsOnAPlaneAreReproduced) {
  DowelScene scene = FlatScene();
  const auto depth = [](const Vec3& p) { return 3 + 0.1 * p.x() + 0.05 * p.y(); };
  for (Dowel& dowel : scene.dowels) {
    dowel.depth_mm = depth(dowel.base);
  }
  const DepthField field = FieldOf(scene);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    const Vec3& p = scene.skull.points[i];
    const bool in_square = p.head<2>().minCoeff() >= 5 && p.head<2>().maxCoeff() <= 35;
    ASSERT_EQ(field.status[i], in_square ? DepthStatus::kAssigned : DepthStatus::kOutside);
    if (in_square) {
      ASSERT_NEAR(field.depth_mm[i], depth(p), 1e-12);
    } else {
      ASSERT_TRUE(std::isnan(field.depth_mm[i]) && std::isnan(field.sd_mm[i]));
    }
  }
}

// Thesis 2.2 literally: M p_c = -D, then the intersection of the line through p and p_c with the
// bases' plane.
Vec3 ThesisProjection(const DowelScene& scene, const Vec3& p) {
  const std::vector<Dowel>& d = scene.dowels;
  Mat3 m;
  Vec3 minus_d;
  for (int k = 0; k < 3; ++k) {
    const Dowel &i = d[k], &j = d[(k + 1) % 3];
    m.row(k) = (i.direction + j.direction).cross(j.base - i.base);
    minus_d[k] = m.row(k).dot(i.base);
  }
  const Vec3 center = m.fullPivLu().solve(minus_d);
  const Vec3 normal = (d[1].base - d[0].base).cross(d[2].base - d[0].base);
  const double t = normal.dot(d[0].base - p) / normal.dot(center - p);
  return p + t * (center - p);
}

double DepthAtFoot(const DowelScene& scene, const Vec3& foot) {
  Mat3 bases;
  bases << scene.dowels[0].base, scene.dowels[1].base, scene.dowels[2].base;
  // The plane does not pass through 0 after the shift, so the bases are a basis.
  const Vec3 shift(0, 0, 50);
  return WeightedDepth(scene, (bases.colwise() + shift).fullPivLu().solve(foot + shift));
}

TEST(Barycentric, IsTheProjectionFromTheMeetOfTheCuttingPlanes) {
  Random random(5);
  int compared = 0;
  for (int n = 0; n < 300; ++n) {
    const auto tilted = [&]() -> Vec3 { return Vec3(0, 0, 1) + random.InBox(-0.4, 0.4); };
    const DowelScene scene = OneArea({tilted(), tilted(), tilted()});
    const Vec3 p = Weighted(scene, RandomWeights(1, n)[0]) + Vec3(0, 0, random.Uniform(-8, 8));
    const DepthField field = FieldOf(scene.At({p}));
    if (field.status[0] == DepthStatus::kAssigned) {
      EXPECT_NEAR(field.depth_mm[0], DepthAtFoot(scene, ThesisProjection(scene, p)), 1e-9);
      ++compared;
    }
  }
  EXPECT_GT(compared, 200);
}

TEST(Barycentric, ParallelDirectionsProjectAlongThem) {
  const Vec3 oblique = Vec3(0.5, -0.3, 1).normalized();
  const DowelScene scene = OneArea({oblique, oblique, oblique});
  for (const Vec3& w : RandomWeights(50, 1)) {
    const Vec3 foot = Weighted(scene, w);
    const DepthField field = FieldOf(scene.At({foot, foot + 30 * oblique, foot - 30 * oblique}));
    for (const double depth : field.depth_mm) {
      EXPECT_NEAR(depth, WeightedDepth(scene, w), 1e-12);
    }
  }
}

// Directions twisted around the axis. The cutting planes share the direction of the axis and have
// no common point, although no two dowels are parallel and none runs along the axis.
std::array<Vec3, 3> Twisted(const DowelScene& scene, double tilt) {
  const Vec3 axis(0, 0, 1);
  std::array<Vec3, 3> directions;
  for (int k = 0; k < 3; ++k) {
    const Vec3 out = scene.dowels[k].base.normalized();
    directions[k] = axis + 0.6 * axis.cross(out) + tilt * out;
  }
  return directions;
}

TEST(Barycentric, PlanesThatMeetNowhereProjectAlongTheirCommonDirection) {
  const Vec3 up(0, 0, 1);
  const DowelScene bases = OneArea({up, up, up});
  const DowelScene scene = OneArea(Twisted(bases, 0));
  for (const Vec3& w : RandomWeights(50, 2)) {
    const Vec3 foot = Weighted(scene, w);
    const DepthField field = FieldOf(scene.At({foot + 12 * up, foot - 12 * up}));
    EXPECT_NEAR(field.depth_mm[0], WeightedDepth(scene, w), 1e-12);
    EXPECT_NEAR(field.depth_mm[1], WeightedDepth(scene, w), 1e-12);
  }
}

TEST(Barycentric, PlanesThatMeetVeryFarAwayAreLikeThoseThatMeetNowhere) {
  const Vec3 up(0, 0, 1);
  const DowelScene bases = OneArea({up, up, up});
  for (const double tilt : {1e-15, 1e-12, 1e-9, -1e-12}) {
    const DowelScene scene = OneArea(Twisted(bases, tilt));
    for (const Vec3& w : RandomWeights(20, 3)) {
      const DepthField field = FieldOf(scene.At({Weighted(scene, w) + 12 * up}));
      EXPECT_NEAR(field.depth_mm[0], WeightedDepth(scene, w), 1e-7);
    }
  }
}

TEST(Barycentric, BoneBeyondTheMeetOfThePlanesIsOutside) {
  DowelScene scene = OneArea({Vec3(0, 0, 1), Vec3(0, 0, 1), Vec3(0, 0, 1)});
  for (Dowel& dowel : scene.dowels) {
    dowel.direction = (dowel.base + Vec3(0, 0, 40)).normalized();  // all from (0, 0, -40)
  }
  const DepthField field =
      FieldOf(scene.At({{0, 0, -39}, {0, 0, -40}, {0, 0, -41}, {0, 5, -90}, {0, 0, 90}}));
  EXPECT_THAT(field.status, ::testing::ElementsAre(DepthStatus::kAssigned, DepthStatus::kOutside,
                                                   DepthStatus::kOutside, DepthStatus::kOutside,
                                                   DepthStatus::kAssigned));
}

TEST(Barycentric, InterpolatesTheDowelsAtTheirBases) {
  const DowelScene scene = DomeScene();
  std::vector<Vec3> bases;
  for (const Dowel& dowel : scene.dowels) {
    bases.push_back(dowel.base);
  }
  const DepthField field = FieldOf(scene.At(bases, {0, -1, 0}));
  for (std::size_t d = 0; d < bases.size(); ++d) {
    EXPECT_EQ(field.status[d], DepthStatus::kAssigned) << scene.dowels[d].site;
    EXPECT_NEAR(field.depth_mm[d], scene.dowels[d].depth_mm, 1e-9);
    EXPECT_NEAR(field.sd_mm[d], scene.dowels[d].sd_mm, 1e-9);
  }
}

TEST(Barycentric, IsContinuousAcrossASharedEdgeAndLeavesNoGapThere) {
  const DowelScene scene = DomeScene();
  const Vec3 n = scene.dowels[3].base, others[] = {scene.dowels[0].base, scene.dowels[2].base};
  for (const Vec3& other : others) {
    const Vec3 across = (other - n).cross(scene.dowels[3].direction).normalized();
    std::vector<Vec3> points;
    for (int s = 1; s < 200; ++s) {
      const Vec3 on_edge = n + (other - n) * s / 200.0;
      points.insert(points.end(), {on_edge, on_edge - 1e-6 * across, on_edge + 1e-6 * across});
    }
    const DepthField field = FieldOf(scene.At(points, {0, -1, 0}));
    for (std::size_t i = 0; i < points.size(); i += 3) {
      ASSERT_EQ(field.status[i], DepthStatus::kAssigned);
      ASSERT_NEAR(field.depth_mm[i], field.depth_mm[i + 1], 1e-6);
      ASSERT_NEAR(field.depth_mm[i], field.depth_mm[i + 2], 1e-6);
    }
  }
}

TEST(Barycentric, WithParallelDirectionsIsContinuousAlsoFarOffTheEdge) {
  const DowelScene scene = FlatScene();
  for (const double t : {7.0, 20.0, 31.0}) {
    const DepthField field =
        FieldOf(scene.At({{t + 1e-6, t - 1e-6, 15}, {t - 1e-6, t + 1e-6, 15}, {t, t, 15}}));
    EXPECT_NEAR(field.depth_mm[0], field.depth_mm[2], 1e-6);
    EXPECT_NEAR(field.depth_mm[1], field.depth_mm[2], 1e-6);
  }
}

TEST(Barycentric, APointInTwoAreasTakesTheNearer) {
  DowelScene scene = FlatScene();
  const std::vector<Dowel> lower = scene.dowels;
  for (Dowel dowel : lower) {
    dowel.base.z() = 20;
    dowel.depth_mm += 10;
    scene.dowels.push_back(dowel);
  }
  scene.network.areas = {{0, 1, 2}, {4, 5, 6}};
  for (const AreaDistance distance : {AreaDistance::kPlane, AreaDistance::kTriangle}) {
    const DepthField field =
        FieldOf(scene.At({{30, 10, 4}, {30, 10, 16}, {30, 10, -50}}), {.distance = distance});
    EXPECT_NEAR(field.depth_mm[1], field.depth_mm[0] + 10, 1e-12);
    EXPECT_NEAR(field.depth_mm[2], field.depth_mm[0], 1e-12);
  }
}

// The second area's bases are 80 mm away, but its plane passes closer by than the first area's.
TEST(Barycentric, TheUnboundedPlaneOfTheThesisCanPickAFarArea) {
  const Vec3 up(0, 0, 1), oblique = Vec3(-1, 0, 0.1).normalized();
  DowelScene scene;
  for (const Vec3& corner : {Vec3(0, 0, 25), Vec3(40, 0, 25), Vec3(20, 60, 25)}) {
    scene.dowels.push_back({"a", corner, up, 5});
    scene.dowels.push_back({"b", corner + Vec3(100, 0, -25), oblique, 20});
  }
  scene.network.areas = {{0, 2, 4}, {1, 3, 5}};
  const DowelScene at = scene.At({{20, 20, 10}});
  EXPECT_NEAR(FieldOf(at, {.distance = AreaDistance::kTriangle}).depth_mm[0], 5, 1e-12);
  EXPECT_NEAR(FieldOf(at, {.distance = AreaDistance::kPlane, .max_angle_deg = 180}).depth_mm[0], 20,
              1e-12);
}

TEST(Barycentric, BoneThatTurnsAwayFromItsAreaGetsNoDepth) {
  const auto run = [](double turned_deg, double max_angle_deg) {
    const double turned = turned_deg * std::numbers::pi / 180;
    const Vec3 normal(std::sin(turned), 0, std::cos(turned));
    return FieldOf(FlatScene().At({{20, 10, 0}}, normal), {.max_angle_deg = max_angle_deg});
  };
  EXPECT_EQ(run(89.9, 90).status[0], DepthStatus::kAssigned);
  EXPECT_EQ(run(90.1, 90).status[0], DepthStatus::kNotFacing);
  EXPECT_TRUE(std::isnan(run(90.1, 90).depth_mm[0]));
  EXPECT_EQ(run(44, 45).status[0], DepthStatus::kAssigned);
  EXPECT_EQ(run(46, 45).status[0], DepthStatus::kNotFacing);
  EXPECT_EQ(run(180, 180).status[0], DepthStatus::kAssigned);
}

TEST(Barycentric, AVertexWithoutNormalDoesNotFace) {
  const DowelScene at = FlatScene().At({{20, 10, 0}}, Vec3::Zero());
  EXPECT_EQ(FieldOf(at).status[0], DepthStatus::kNotFacing);
  EXPECT_EQ(FieldOf(at, {.max_angle_deg = 180}).status[0], DepthStatus::kAssigned);
}

TEST(Barycentric, IsInvariantUnderRigidMotionAndCovariantWithScale) {
  const DowelScene scene = DomeScene();
  const DepthField field = FieldOf(scene);
  const Similarity moved{
      1.7, Eigen::AngleAxisd(0.9, Vec3(1, 2, -1).normalized()).toRotationMatrix(), {300, -20, 55}};
  DowelScene other = scene;
  other.skull = Transformed(scene.skull, moved);
  for (Vec3& normal : other.normals) {
    normal = moved.rotation * normal;
  }
  for (Dowel& dowel : other.dowels) {
    dowel.base = moved * dowel.base;
    dowel.direction = moved.rotation * dowel.direction;
    dowel.depth_mm *= moved.scale;
  }
  const DepthField other_field = FieldOf(other);
  EXPECT_GT(Count(field, DepthStatus::kAssigned), 100);
  EXPECT_EQ(field.status, other_field.status);
  for (std::size_t i = 0; i < field.status.size(); ++i) {
    if (field.status[i] == DepthStatus::kAssigned) {
      ASSERT_NEAR(other_field.depth_mm[i], moved.scale * field.depth_mm[i], 1e-9);
    }
  }
}

TEST(Barycentric, APartialNetworkKeepsTheOtherAreasAsTheyWere) {
  DowelScene scene = FlatScene();
  const DepthField whole = FieldOf(scene);
  scene.dowels.pop_back();
  scene.network = BuildNetwork({"", {}, {{"sg", "g", "n"}, {"sg", "n", "rhi"}}}, scene.dowels);
  ASSERT_EQ(scene.network.areas.size(), 1u);
  const DepthField partial = FieldOf(scene);
  for (std::size_t i = 0; i < whole.status.size(); ++i) {
    const Vec3& p = scene.skull.points[i];
    const bool below_diagonal = p.y() < p.x();
    ASSERT_EQ(partial.status[i],
              below_diagonal || p.x() == p.y() ? whole.status[i] : DepthStatus::kOutside);
    if (below_diagonal && whole.status[i] == DepthStatus::kAssigned) {
      ASSERT_EQ(partial.depth_mm[i], whole.depth_mm[i]);
    }
  }
}

TEST(Barycentric, AMissingDeviationOnlyBlanksItsAreas) {
  DowelScene scene = FlatScene();
  scene.dowels[3].sd_mm = kNaN;
  const DepthField field = FieldOf(scene.At({{30, 10, 0}, {10, 30, 0}}));
  EXPECT_NEAR(field.sd_mm[0], (1 + 4 * 2 + 3) / 6.0, 1e-12);
  EXPECT_TRUE(std::isnan(field.sd_mm[1]));
  EXPECT_TRUE(std::isfinite(field.depth_mm[1]));
}

std::string ErrorOf(const DowelScene& scene) {
  try {
    FieldOf(scene);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(Barycentric, NamesTheDegenerateArea) {
  DowelScene scene = FlatScene();
  scene.dowels[1].direction = {0, 0, -1};
  EXPECT_EQ(ErrorOf(scene),
            "dowel network: area sg g n: the directions of g and n cancel or run along their edge, "
            "which leaves no cutting plane; correct a direction or leave the area out");
  scene = FlatScene();
  scene.dowels[1].direction = scene.dowels[2].direction = {0, 1, 0};
  EXPECT_EQ(ErrorOf(scene),
            "dowel network: area sg g n: the directions of g and n cancel or run along their edge, "
            "which leaves no cutting plane; correct a direction or leave the area out");
  scene = FlatScene();
  scene.dowels[1].direction = scene.dowels[2].direction = {1, 0, 0};
  EXPECT_EQ(ErrorOf(scene),
            "dowel network: area sg g n: the cutting plane of g and n runs through sg, which "
            "leaves no inside; correct a direction or leave the area out");
  scene = FlatScene();
  scene.dowels[1].base = {20, 20, 0};
  EXPECT_EQ(ErrorOf(scene),
            "dowel network: area sg g n: the three bases lie on one line; move a base or leave the "
            "area out");
}

TEST(Barycentric, NeedsAnArea) {
  DowelScene scene = FlatScene();
  scene.network.areas.clear();
  EXPECT_EQ(ErrorOf(scene),
            "dowel network: there is no area, but barycentric depth needs at least one; place the "
            "dowels of an area, or use the scheme nearest or mean");
}

}  // namespace
}  // namespace semblance::interp
