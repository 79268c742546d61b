// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_primitives.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;
using testing::SphereMesh;

std::string ErrorOf(const TriMesh& mesh) {
  try {
    CheckHeadMesh(mesh, "skull.ply");
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(MeshCheck, ASoundHeadHasNoNotes) {
  EXPECT_TRUE(CheckHeadMesh(SphereMesh({0, 0, 0}, 100, 20), "a").empty());
}

TEST(MeshCheck, AnotherUnitIsNamed) {
  EXPECT_THAT(
      ErrorOf(SphereMesh({0, 0, 0}, 0.1, 20)),
      "skull.ply: its longest side is 0.2 mm, which is not that of a head (60 to 500 mm); it looks "
      "like metres; multiply by 1000, or say its unit (subject.units)");
  EXPECT_THAT(ErrorOf(SphereMesh({0, 0, 0}, 10, 20)),
              HasSubstr("it looks like centimetres; multiply by 10,"));
  EXPECT_THAT(ErrorOf(SphereMesh({0, 0, 0}, 4.5, 20)),
              HasSubstr("it looks like inches; multiply by 25.4,"));
}

TEST(MeshCheck, AMovedCopyIsNoted) {
  const auto is_noted = [](const TriMesh& other) {
    TriMesh both = SphereMesh({0, 0, 0}, 80, 20);
    Append(both, other);
    const std::vector<std::string> notes = CheckHeadMesh(both, "skull.ply");
    return std::ranges::any_of(notes, [](const std::string& note) {
      return note.find("two copies of one surface") != note.npos;
    });
  };
  EXPECT_TRUE(is_noted(SphereMesh({2, 0, 0}, 80, 20)));
  EXPECT_FALSE(is_noted(SphereMesh({2, 0, 0}, 79, 20)));
  EXPECT_FALSE(is_noted(SphereMesh({2, 0, 0}, 80, 24)));
}

TEST(MeshCheck, WhatIsTooFarAwayOrHasNoAreaIsRefused) {
  EXPECT_EQ(ErrorOf(SphereMesh({9e4, 0, 0}, 100, 20)), "accepted");
  EXPECT_THAT(ErrorOf(SphereMesh({1.1e5, 0, 0}, 100, 20)), HasSubstr("move it to within 100 m"));
  EXPECT_THAT(ErrorOf(SphereMesh({0, 1e15, 0}, 100, 20)), HasSubstr("skull.ply: "));
  TriMesh line = SphereMesh({0, 0, 0}, 100, 20);
  for (Vec3& p : line.points) {
    p.x() = p.y() = 0;
  }
  EXPECT_THAT(ErrorOf(line), HasSubstr("have an area of 0 mm² in all"));
}

TEST(MeshCheck, AMeshInsideOutIsRefusedNotTurned) {
  TriMesh sphere = SphereMesh({0, 0, 0}, 100, 20);
  for (Triangle& t : sphere.triangles) {
    std::swap(t[0], t[1]);
  }
  EXPECT_THAT(ErrorOf(sphere), HasSubstr("skull.ply: 100 % of its outside shows triangles' backs: "
                                         "the mesh is inside out; flip its normals"));
  EXPECT_THAT(ErrorOf(TriMesh{}), HasSubstr("has no triangles"));
}

TEST(MeshCheck, LesserDefectsAreNotes) {
  TriMesh sphere = SphereMesh({0, 0, 0}, 100, 20);
  sphere.triangles.pop_back();
  EXPECT_THAT(CheckHeadMesh(sphere, "a"), ::testing::ElementsAre(HasSubstr("a: 3 of")));
}

TEST(MeshCheck, RealScansAreOutward) {
  for (const char* file : {"vhm/skull.ply", "vhm/skin.ply", "cthead/skull.ply", "cranium/skull.ply",
                           "cranium/skin.ply"}) {
    const auto path = std::filesystem::path(SEMBLANCE_SOURCE_DIR) / "../shared/data" / file;
    if (!std::filesystem::exists(path)) {
      GTEST_SKIP() << "the prepared real subjects are not here";
    }
    EXPECT_NO_THROW(CheckHeadMesh(ReadMesh(path), file));
  }
}

}  // namespace
}  // namespace semblance::surfaces
