// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/decimate/decimate.h"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using testing::Joined;
using testing::Plate;
using testing::Shuffled;
using testing::SphereMesh;

TriMesh Torus(int around, int across) {
  TriMesh mesh;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * j / across;
      const double r = 40 + 15 * std::cos(v);
      mesh.points.emplace_back(r * std::cos(u), r * std::sin(u), 15 * std::sin(v));
      const int a = i * across + j, b = (i + 1) % around * across + j,
                c = (i + 1) % around * across + (j + 1) % across, d = i * across + (j + 1) % across;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

TriMesh Noisy(TriMesh mesh, double noise_mm) {
  Random random(7);
  for (Vec3& p : mesh.points) {
    p += random.InBox(-noise_mm, noise_mm);
  }
  return mesh;
}

// A sheet with two round holes and one straight and one curved side.
TriMesh HoledSheet() {
  TriMesh sheet = Plate(60, 48);
  for (Vec3& p : sheet.points) {
    p.z() = 3 * std::sin(p.x() / 9) * std::cos(p.y() / 11);
  }
  std::vector<bool> keep;
  for (const Triangle& t : sheet.triangles) {
    const Vec3 c = TriangleCentroid(sheet, t);
    keep.push_back((c.head<2>() - Vec2(18, 20)).norm() > 7 &&
                   (c.head<2>() - Vec2(42, 38)).norm() > 9 && c.x() + 0.01 * c.y() * c.y() < 80);
  }
  return Submesh(sheet, keep);
}

// A box of side 10 in n x n squares a face.
TriMesh Box(int n) {
  TriMesh mesh;
  std::map<std::array<int, 3>, std::int32_t> numbers;
  const auto at = [&](const std::array<int, 3>& p) {
    const auto [it, is_new] = numbers.try_emplace(p, static_cast<std::int32_t>(numbers.size()));
    if (is_new) {
      mesh.points.push_back(10.0 / n * Vec3(p[0], p[1], p[2]));
    }
    return it->second;
  };
  for (int face = 0; face < 6; ++face) {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        const auto corner = [&](int di, int dj) {
          std::array<int, 3> p{};
          p[face % 3] = face < 3 ? 0 : n;
          p[(face + 1) % 3] = face < 3 ? j + dj : i + di;
          p[(face + 2) % 3] = face < 3 ? i + di : j + dj;
          return at(p);
        };
        mesh.triangles.push_back({corner(0, 0), corner(1, 0), corner(1, 1)});
        mesh.triangles.push_back({corner(0, 0), corner(1, 1), corner(0, 1)});
      }
    }
  }
  return mesh;
}

struct Shape {
  const char* name;
  TriMesh mesh;
};

std::vector<Shape> Shapes() {
  return {{"sphere", SphereMesh({3, 2, 1}, 50, 40)},
          {"noisy sphere", Noisy(SphereMesh({0, 0, 0}, 50, 20), 0.1)},
          {"torus", Torus(80, 40)},
          {"noisy torus", Noisy(Torus(80, 40), 0.2)},
          {"holed sheet", HoledSheet()},
          {"three parts", Joined(Joined(SphereMesh({0, 0, 0}, 20, 20), Torus(60, 24)),
                                 SphereMesh({0, 0, 60}, 0.2, 6))},
          {"box", Box(16)}};
}

int BorderLoops(const TriMesh& mesh) {
  std::vector<int> parent(mesh.points.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) {
      v = parent[v];
    }
    return v;
  };
  int joins = 0;
  std::set<int> points;
  for (const MeshEdge& e : BorderEdges(mesh)) {
    points.insert(e.begin(), e.end());
    const int a = root(e[0]), b = root(e[1]);
    parent[a] = b;
    joins += a != b ? 1 : 0;
  }
  return static_cast<int>(points.size()) - joins;
}

std::int64_t Euler(const TriMesh& mesh) {
  return std::int64_t(mesh.points.size()) - CheckEdges(mesh).edges +
         std::int64_t(mesh.triangles.size());
}

void ExpectSameTopology(const TriMesh& before, const TriMesh& after) {
  const EdgeReport edges = CheckEdges(after);
  EXPECT_EQ(edges.non_manifold, 0);
  EXPECT_EQ(edges.inconsistent, 0);
  EXPECT_EQ(Euler(after), Euler(before));
  EXPECT_EQ(ConnectedComponents(after).count, ConnectedComponents(before).count);
  EXPECT_EQ(BorderLoops(after), BorderLoops(before));
  const MeshQuery query(before);
  for (const Triangle& t : after.triangles) {
    const Vec3 there = TriangleAreaVector(
        before, before.triangles[query.Closest(TriangleCentroid(after, t)).triangle]);
    EXPECT_GT(TriangleAreaVector(after, t).dot(there), 0);
  }
}

// The furthest of a mesh's vertices and, if `inside` its triangles are looked at too, of points
// inside its triangles from the other.
double Furthest(const TriMesh& from, const TriMesh& to, bool inside) {
  const MeshQuery query(to);
  double most = 0;
  for (const Vec3& p : from.points) {
    most = std::max(most, query.Closest(p).distance_mm);
  }
  constexpr int kParts = 4;
  for (const Triangle& t : inside ? from.triangles : std::vector<Triangle>{}) {
    for (int i = 0; i <= kParts; ++i) {
      for (int j = 0; i + j <= kParts; ++j) {
        const Vec3 p =
            (i * from.points[t[0]] + j * from.points[t[1]] + (kParts - i - j) * from.points[t[2]]) /
            kParts;
        most = std::max(most, query.Closest(p).distance_mm);
      }
    }
  }
  return most;
}

constexpr bool kInsideToo = true, kVerticesOnly = false;

TEST(Decimate, KeepsTopologyAndSidesAndReachesItsTarget) {
  for (const auto& [name, mesh] : Shapes()) {
    SCOPED_TRACE(name);
    for (const int part : {3, 12}) {
      const int target = static_cast<int>(mesh.triangles.size()) / part;
      const DecimateResult result = Decimate(mesh, {.target_triangles = target});
      ExpectSameTopology(mesh, result.mesh);
      EXPECT_EQ(result.summary.triangles, int(result.mesh.triangles.size()));
      EXPECT_LE(result.summary.triangles, target);
      EXPECT_GE(result.summary.triangles, target - 1);
      EXPECT_EQ(result.summary.stop, DecimateStop::kTarget);
    }
  }
}

TEST(Decimate, KeepsToItsToleranceAndSaysHowFarItWent) {
  for (const auto& [name, mesh] : Shapes()) {
    for (const double tolerance : {0.05, 0.5}) {
      SCOPED_TRACE(fmt::format("{}, {} mm", name, tolerance));
      const DecimateResult result = Decimate(mesh, {.tolerance_mm = tolerance});
      ExpectSameTopology(mesh, result.mesh);
      const double most = Furthest(mesh, result.mesh, kVerticesOnly);
      EXPECT_LE(most, result.summary.error_mm + 1e-9);
      EXPECT_LE(result.summary.error_mm, tolerance);
      EXPECT_LE(Furthest(result.mesh, mesh, kVerticesOnly), tolerance);
      EXPECT_LE(Furthest(mesh, result.mesh, kInsideToo), 1.5 * tolerance);
      EXPECT_LE(Furthest(result.mesh, mesh, kInsideToo), 1.5 * tolerance);
      EXPECT_LT(result.mesh.triangles.size(), mesh.triangles.size());
      EXPECT_NE(result.summary.stop, DecimateStop::kNotRun);
    }
  }
}

TEST(Decimate, ALargerToleranceLeavesFewerTriangles) {
  const TriMesh torus = Torus(120, 60);
  int last = static_cast<int>(torus.triangles.size());
  for (const double tolerance : {0.02, 0.1, 0.5, 2.0}) {
    const int now = Decimate(torus, {.tolerance_mm = tolerance}).summary.triangles;
    EXPECT_LT(now, 0.8 * last);
    last = now;
  }
  EXPECT_LT(last, 300);
}

TEST(Decimate, ABoxIsLeftWithItsEightCorners) {
  const TriMesh box = Box(16);
  const DecimateResult result = Decimate(box, {.tolerance_mm = 1e-6});
  EXPECT_EQ(result.summary.triangles, 12);
  EXPECT_NEAR(SignedVolume(result.mesh), 1000, 1e-6);
  EXPECT_NEAR(Area(result.mesh), 600, 1e-6);
  EXPECT_LE(Furthest(box, result.mesh, kInsideToo), 1e-8);
  EXPECT_LE(Furthest(result.mesh, box, kInsideToo), 1e-8);
}

TEST(Decimate, APlateKeepsItsBorder) {
  const TriMesh plate = Plate(30, 20);
  const DecimateResult result = Decimate(plate, {.tolerance_mm = 1e-6});
  EXPECT_LE(result.summary.triangles, 4);
  EXPECT_NEAR(Area(result.mesh), 900, 1e-9);
  for (const Vec3& corner : {Vec3(0, 0, 0), Vec3(30, 0, 0), Vec3(0, 30, 0), Vec3(30, 30, 0)}) {
    EXPECT_TRUE(std::any_of(result.mesh.points.begin(), result.mesh.points.end(),
                            [&](const Vec3& p) { return (p - corner).norm() < 1e-9; }));
  }
  EXPECT_LE(Furthest(plate, result.mesh, kInsideToo), 1e-9);
  EXPECT_LE(Furthest(result.mesh, plate, kInsideToo), 1e-9);
}

TEST(Decimate, StopsShortOfARuin) {
  for (const auto& [name, mesh] : Shapes()) {
    SCOPED_TRACE(name);
    const DecimateResult result = Decimate(mesh, {});
    ExpectSameTopology(mesh, result.mesh);
    EXPECT_EQ(result.summary.stop, DecimateStop::kNoSoundCollapse);
    EXPECT_GT(result.summary.triangles, 4);
    EXPECT_LT(result.summary.error_mm, 20);
  }
}

// A skin of two sheets, most of it grown together to one: its sheets have no room to move, and a
// small round part is not to pay for that.
TEST(Decimate, WhatCanStillGiveDoesNotPayForWhatCannot) {
  TriMesh mesh = SphereMesh({0, 0, 0}, 10, 24);
  const int round = static_cast<int>(mesh.triangles.size());
  for (int k = 0; k < 400; ++k) {  // octahedra: nothing can be taken from them
    mesh = Joined(mesh, SphereMesh({40.0 + 5 * (k % 20), 5.0 * (k / 20), 0}, 1, 2));
  }
  const DecimateResult result = Decimate(mesh, {.target_triangles = 100});
  EXPECT_EQ(result.summary.stop, DecimateStop::kNoSoundCollapse);
  EXPECT_LT(result.summary.error_mm, 1);
  EXPECT_GT(result.summary.triangles, 400 * 4);
  EXPECT_LT(result.summary.triangles, 400 * 8 + round / 2);
}

TEST(Decimate, TrianglesWithoutAreaGo) {
  TriMesh plate = Plate(30, 20);
  for (Vec3& p : plate.points) {
    p.x() = std::min(std::floor(p.x() / 4) * 4, 28.0);
    p.z() = 0.01 * p.x() * p.y();
  }
  const DecimateResult result = Decimate(plate, {.tolerance_mm = 0.2});
  EXPECT_LT(result.summary.triangles, 60);
  EXPECT_LE(Furthest(plate, result.mesh, kVerticesOnly), 0.2);
}

double Rms(const TriMesh& from, const TriMesh& to) {
  const MeshQuery query(to);
  double sum = 0;
  for (const Vec3& p : from.points) {
    sum += std::pow(query.Closest(p).distance_mm, 2);
  }
  return std::sqrt(sum / static_cast<double>(from.points.size()));
}

// With a tolerance that binds nothing, the same triangles are left, and their vertices stay.
TEST(Decimate, WithoutAToleranceTheVerticesSettleAmongTheOriginalOnes) {
  for (const TriMesh& mesh : {SphereMesh({3, 2, 1}, 50, 40), Noisy(Torus(80, 40), 0.2)}) {
    const DecimateResult stay = Decimate(mesh, {.target_triangles = 400, .tolerance_mm = 1e6}),
                         settle = Decimate(mesh, {.target_triangles = 400});
    EXPECT_EQ(settle.mesh.triangles, stay.mesh.triangles);
    EXPECT_LT(Rms(mesh, settle.mesh), 0.95 * Rms(mesh, stay.mesh));
    EXPECT_LE(Furthest(mesh, settle.mesh, kVerticesOnly), settle.summary.error_mm + 1e-9);
  }
  const TriMesh box = Box(16);  // nothing draws its corners
  const TriMesh left = Decimate(box, {.target_triangles = 12}).mesh;
  EXPECT_NEAR(SignedVolume(left), 1000, 1e-6);
}

TEST(Decimate, AMeshInNoOrderIsDecimatedAsWellAndKeepsItsOrder) {
  const TriMesh torus = Torus(160, 80), mesh = Shuffled(torus);
  const DecimateResult sorted = Decimate(torus, {.target_triangles = 1000}),
                       result = Decimate(mesh, {.target_triangles = 1000});
  ExpectSameTopology(mesh, result.mesh);
  EXPECT_EQ(result.summary.triangles, 1000);
  EXPECT_LT(Rms(mesh, result.mesh), 1.1 * Rms(torus, sorted.mesh));
  // After one collapse all points but one are where they were, or one place further in front.
  const int one_less = static_cast<int>(mesh.triangles.size()) - 2;
  const TriMesh once = Decimate(mesh, {.target_triangles = one_less, .tolerance_mm = 1e6}).mesh;
  ASSERT_EQ(once.points.size(), mesh.points.size() - 1);
  std::size_t kept = 0;
  for (std::size_t v = 0; v < once.points.size(); ++v) {
    kept += once.points[v] == mesh.points[v] || once.points[v] == mesh.points[v + 1] ? 1 : 0;
  }
  EXPECT_EQ(kept, once.points.size() - 1);
}

TEST(Decimate, AMovedMeshGivesTheMovedResult) {
  const TriMesh mesh = Noisy(Torus(60, 30), 0.2);
  const Similarity motion{
      .rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
      .translation = {30, -70, 210}};
  const TriMesh here = Decimate(mesh, {.target_triangles = 900}).mesh,
                there = Decimate(Transformed(mesh, motion), {.target_triangles = 900}).mesh;
  ASSERT_EQ(here.triangles, there.triangles);
  for (std::size_t v = 0; v < here.points.size(); ++v) {
    EXPECT_LT((motion * here.points[v] - there.points[v]).norm(), 1e-7);
  }
}

TEST(Decimate, SameInputSameBytes) {
  const TriMesh mesh = Noisy(Torus(60, 30), 0.2);
  const TriMesh a = Decimate(mesh, {.target_triangles = 600}).mesh,
                b = Decimate(mesh, {.target_triangles = 600}).mesh;
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(Decimate, FewEnoughAlreadyIsLeftAsItIs) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 50, 10);
  const DecimateResult result = Decimate(sphere, {.target_triangles = 5000});
  EXPECT_EQ(result.mesh.points, sphere.points);
  EXPECT_EQ(result.mesh.triangles, sphere.triangles);
  EXPECT_EQ(result.summary.error_mm, 0);
  EXPECT_EQ(result.summary.stop, DecimateStop::kTarget);
}

TEST(Decimate, RefusesWhatItCannotTake) {
  const TriMesh plate = Plate(10, 4);
  EXPECT_THROW(Decimate(plate, {.target_triangles = 3}), InputError);
  EXPECT_THROW(Decimate(plate, {.tolerance_mm = 0}), InputError);
  EXPECT_THROW(Decimate(plate, {.tolerance_mm = kNaN}), InputError);
  TriMesh bad = plate;
  bad.points[3].y() = kNaN;
  EXPECT_THROW(Decimate(bad, {}), InputError);
}

// Real scans have edges with three triangles, turned triangles and pinched vertices.
TEST(Decimate, AMeshThatIsNoManifoldLosesNoTriangleAtItsFaults) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 30, 40);
  TriMesh fin = sphere;
  const auto tip = static_cast<std::int32_t>(fin.points.size());
  fin.points.emplace_back(0, 0, 45);
  fin.triangles.push_back({sphere.triangles[900][0], sphere.triangles[900][1], tip});
  TriMesh turned = sphere;
  std::swap(turned.triangles[700][0], turned.triangles[700][1]);
  TriMesh pinched = Joined(Noisy(Plate(30, 20), 0.01), Noisy(Plate(30, 20), 0.01));
  for (Triangle& t : pinched.triangles) {
    std::ranges::replace(t, 441, 440);  // the first corner of one plate, the last of the other
  }
  for (const TriMesh& mesh : {fin, turned, pinched}) {
    const int target = static_cast<int>(mesh.triangles.size()) / 4;
    const DecimateResult result = Decimate(mesh, {.target_triangles = target, .tolerance_mm = 2});
    EXPECT_LE(result.summary.triangles, target);
    EXPECT_EQ(result.summary.triangles, int(result.mesh.triangles.size()));
    const EdgeReport before = CheckEdges(mesh), after = CheckEdges(result.mesh);
    EXPECT_EQ(after.non_manifold, before.non_manifold);
    EXPECT_EQ(after.inconsistent, before.inconsistent);
    EXPECT_EQ(after.boundary > 0, before.boundary > 0);
    EXPECT_EQ(ConnectedComponents(result.mesh).count, ConnectedComponents(mesh).count);
    EXPECT_LE(Furthest(mesh, result.mesh, kVerticesOnly), 2);
  }
}

}  // namespace
}  // namespace semblance::surfaces
