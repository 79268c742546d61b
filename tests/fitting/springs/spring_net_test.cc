// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/springs/spring_net.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/shapes.h"

namespace semblance::fitting {
namespace {

using testing::SphereMesh;
using testing::WordsOf;

constexpr int kSide = 9;
constexpr double kRadius_mm = 50;

// A net over the front of a sphere of radius r about the origin; outward is -y.
SpringNet NetOnSphere(double radius_mm) {
  SpringNet net{.columns = kSide, .rows = kSide, .vertices = {}, .at_rest = {}, .holds = {}};
  for (int k = 0; k < kSide * kSide; ++k) {
    const double a = 0.9 * (k % kSide - 4) / 4.0, b = 0.9 * (k / kSide - 4) / 4.0;
    net.vertices.push_back(
        radius_mm * Vec3(std::sin(a) * std::cos(b), -std::cos(a) * std::cos(b), std::sin(b)));
  }
  net.at_rest = net.vertices;
  net.holds.assign(net.vertices.size(), SpringHold::kHeld);
  return net;
}

void LockCorners(SpringNet& net) {
  for (const int v : {0, kSide - 1, kSide * (kSide - 1), kSide * kSide - 1}) {
    net.holds[v] = SpringHold::kLocked;
  }
}

TriMesh Ball(double radius_mm) { return SphereMesh(Vec3::Zero(), radius_mm, 60); }

double LargestDistance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    most = std::max(most, (a[v] - b[v]).norm());
  }
  return most;
}

TEST(SpringNet, ANetAtRestStays) {
  SpringNet net = NetOnSphere(kRadius_mm);
  const std::vector<Vec3> start = net.vertices;
  const SpringSummary alone = RelaxSprings({}, Ball(30), {}, net, {});
  EXPECT_EQ(net.vertices, start);
  EXPECT_TRUE(alone.usable);
  EXPECT_EQ(alone.held, 0);
  // On the implicit face itself only its facets move the net. Locked corners keep it from turning
  // about the sphere, which costs nothing.
  LockCorners(net);
  RelaxSprings(Ball(kRadius_mm), Ball(30), {}, net, {});
  EXPECT_LT(LargestDistance(net.vertices, start), 0.1);
}

TEST(SpringNet, HeldVerticesComeToTheDepth) {
  SpringNet net = NetOnSphere(kRadius_mm);
  for (Vec3& v : net.at_rest) {
    v *= 54 / kRadius_mm;  // springs that fit the larger sphere
  }
  const SpringSummary summary = RelaxSprings(Ball(54), Ball(30), {}, net, {});
  EXPECT_TRUE(summary.usable);
  EXPECT_EQ(summary.held, kSide * kSide);
  for (const Vec3& v : net.vertices) {
    EXPECT_NEAR(v.norm(), 54, 0.1);
  }
  ASSERT_EQ(summary.terms.size(), 3U);
  EXPECT_LT(summary.terms[1].after, 0.01 * summary.terms[1].before);
}

TEST(SpringNet, LockedVerticesStayToTheBit) {
  SpringNet net = NetOnSphere(kRadius_mm);
  net.holds[0] = net.holds[40] = net.holds[77] = SpringHold::kLocked;
  const std::vector<Vec3> start = net.vertices;
  const SpringSummary summary = RelaxSprings(Ball(55), Ball(30), {}, net, {});
  EXPECT_EQ(summary.locked, 3);
  EXPECT_GT(summary.max_move_mm, 1);
  for (const int v : {0, 40, 77}) {
    EXPECT_EQ(net.vertices[v], start[v]);
  }
}

// Free vertices between moved ones follow them by the springs alone.
TEST(SpringNet, FreeVerticesFollowTheirSprings) {
  SpringNet net = NetOnSphere(kRadius_mm);
  net.holds.assign(net.vertices.size(), SpringHold::kLocked);
  for (Vec3& v : net.vertices) {
    v += Vec3(3, -2, 1);
  }
  net.vertices[40] -= Vec3(3, -2, 1);
  net.holds[40] = SpringHold::kFree;
  RelaxSprings(Ball(kRadius_mm), {}, {.rounds = 30}, net, {});
  EXPECT_LT((net.vertices[40] - net.at_rest[40] - Vec3(3, -2, 1)).norm(), 0.05);
}

TEST(SpringNet, ARigidMotionOfAllInputsMovesTheResult) {
  Similarity motion;
  motion.rotation = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  motion.translation = Vec3(20, -70, 110);
  SpringNet net = NetOnSphere(kRadius_mm);
  LockCorners(net);
  SpringNet moved = net;
  for (std::size_t v = 0; v < net.vertices.size(); ++v) {
    moved.vertices[v] = motion * net.vertices[v];
    moved.at_rest[v] = motion * net.at_rest[v];
  }
  RelaxSprings(Ball(55), Ball(30), {}, net, {});
  RelaxSprings(Transformed(Ball(55), motion), Transformed(Ball(30), motion), {}, moved, {});
  for (Vec3& v : net.vertices) {
    v = motion * v;
  }
  // Ceres ends each round within a tolerance, and the facets make the cost uneven.
  EXPECT_LT(LargestDistance(net.vertices, moved.vertices), 0.01);
}

// An implicit face inside the bone pulls the net inwards.
TEST(SpringNet, NoVertexEndsInTheBone) {
  for (const double depth_radius_mm : {40.0, 44.0, 49.0}) {
    SpringNet net = NetOnSphere(kRadius_mm);
    const TriMesh bone = Ball(46);
    RelaxSprings(Ball(depth_radius_mm), bone, {}, net, {});
    const MeshQuery query(bone);
    for (const Vec3& v : net.vertices) {
      const MeshPoint foot = query.Closest(v);
      EXPECT_GE(v.norm(), foot.position.norm()) << depth_radius_mm;
    }
  }
}

TEST(SpringNet, TheSameInputGivesTheSameBytes) {
  SpringNet first = NetOnSphere(kRadius_mm), second = first;
  RelaxSprings(Ball(53), Ball(30), {}, first, {});
  RelaxSprings(Ball(53), Ball(30), {}, second, {});
  EXPECT_EQ(first.vertices, second.vertices);
}

TEST(SpringNet, SizesThatDoNotAgreeAreRefused) {
  SpringNet net = NetOnSphere(kRadius_mm);
  net.at_rest.pop_back();
  EXPECT_THAT(WordsOf<InputError>([&] { RelaxSprings({}, {}, {}, net, {}); }),
              ::testing::HasSubstr("9 x 9 vertices, with 81 positions, 80 at rest and 81 holds"));
}

}  // namespace
}  // namespace semblance::fitting
