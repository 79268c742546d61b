// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/face_export.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/hspline/patch_tree.h"
#include "surfaces/hspline_query/tessellate.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

using testing::RandomSurface;

const HSplineShape kShape{.patches_u = 4, .patches_v = 5, .max_level = 3};

// The numbers of the n-th data array.
std::vector<double> Array(const std::string& vtu, int n) {
  std::size_t at = 0;
  for (int k = 0; k <= n; ++k) {
    at = vtu.find("<DataArray", at) + 1;
  }
  at = vtu.find('>', at) + 1;
  std::istringstream text(vtu.substr(at, vtu.find('<', at) - at));
  return {std::istream_iterator<double>(text), {}};
}

// The cubic with the value 1 at k/3 and 0 at the other multiples of 1/3.
double Lagrange(int k, double t) {
  double product = 1;
  for (int other = 0; other < 4; ++other) {
    product *= other == k ? 1 : (3 * t - other) / (k - other);
  }
  return product;
}

// VTK's own rule (vtkHigherOrderQuadrilateral::PointIndexFromIJK) for degree 3.
int VtkIndex(int i, int j) {
  const bool i_end = i == 0 || i == 3, j_end = j == 0 || j == 3;
  if (i_end && j_end) {
    return i != 0 ? (j != 0 ? 2 : 1) : (j != 0 ? 3 : 0);
  }
  if (j_end) {
    return i - 1 + (j != 0 ? 4 : 0) + 4;
  }
  return i_end ? j - 1 + (i != 0 ? 2 : 6) + 4 : 12 + (i - 1) + 2 * (j - 1);
}

TEST(FaceExport, TheLagrangePatchesAreTheSurface) {
  const HSplineSurface surface = RandomSurface(kShape, 1);
  const std::string vtu = SurfaceToVtu(surface);
  const PatchTree tree(surface);
  const std::vector<double> points = Array(vtu, 0);
  ASSERT_EQ(points.size(), 48 * tree.leaves().size());
  Random random(1);
  for (std::size_t p = 0; p < tree.leaves().size(); ++p) {
    const PatchId patch = tree.leaves()[p];
    const double s = random.Uniform(0, 1), t = random.Uniform(0, 1);
    Vec3 sum = Vec3::Zero();
    for (int k = 0; k < 16; ++k) {
      const double* x = &points[48 * p + 3 * VtkIndex(k % 4, k / 4)];
      sum += Lagrange(k % 4, s) * Lagrange(k / 4, t) * Vec3(x[0], x[1], x[2]);
    }
    const Vec2 uv((patch.i + s) / kShape.PatchesU(patch.level),
                  (patch.j + t) / kShape.PatchesV(patch.level));
    EXPECT_LT((sum - surface.Point(uv)).norm(), 1e-10);
  }
}

TEST(FaceExport, TheVtuFollowsVtksFormat) {
  const HSplineSurface surface = RandomSurface(kShape, 2);
  const std::string vtu = SurfaceToVtu(surface);
  const std::size_t count = PatchTree(surface).leaves().size();
  EXPECT_NE(vtu.find("NumberOfPoints=\"" + std::to_string(16 * count) + "\" NumberOfCells=\"" +
                     std::to_string(count) + "\""),
            std::string::npos);
  const std::vector<double> connectivity = Array(vtu, 1), offsets = Array(vtu, 2),
                            types = Array(vtu, 3), levels = Array(vtu, 4);
  ASSERT_EQ(connectivity.size(), 16 * count);
  for (std::size_t k = 0; k < connectivity.size(); ++k) {
    EXPECT_EQ(connectivity[k], k);
  }
  ASSERT_EQ(offsets.size(), count);
  EXPECT_EQ(offsets.back(), 16 * count);
  EXPECT_EQ(types, std::vector<double>(count, 70));
  ASSERT_EQ(levels.size(), count);
  EXPECT_EQ(levels[0], PatchTree(surface).leaves()[0].level);
  std::vector<std::string> open;  // each element is closed, in order
  const std::regex tag("<(/?)([A-Za-z]+)[^>]*>");
  for (std::sregex_iterator it(vtu.begin() + vtu.find('\n'), vtu.end(), tag), end; it != end;
       ++it) {
    if ((*it)[1].length() == 0) {
      open.push_back((*it)[2]);
    } else {
      ASSERT_EQ(open.back(), (*it)[2]);
      open.pop_back();
    }
  }
  EXPECT_TRUE(open.empty());
}

template <class T>
T At(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

TEST(FaceExport, TheGlbHoldsTheMeshInMetresWithTheFaceTowardsZ) {
  const Tessellation t = TessellateToChord(RandomSurface(kShape, 3), 0.3);
  const std::string glb = TessellationToGlb(t);
  ASSERT_EQ(glb.substr(0, 4), "glTF");
  EXPECT_EQ(At<std::uint32_t>(glb, 4), 2u);
  ASSERT_EQ(At<std::uint32_t>(glb, 8), glb.size());
  const std::size_t json_size = At<std::uint32_t>(glb, 12), bin = 20 + json_size + 8;
  EXPECT_EQ(json_size % 4, 0u);
  EXPECT_EQ(glb.substr(16, 4), "JSON");
  EXPECT_EQ(glb.substr(bin - 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(At<std::uint32_t>(glb, bin - 8), glb.size() - bin);
  const auto json = nlohmann::json::parse(glb.substr(20, json_size));
  EXPECT_EQ(json.at("asset").at("version"), "2.0");
  EXPECT_LE(json["buffers"][0]["byteLength"].get<std::size_t>(), glb.size() - bin);
  const auto& primitive = json["meshes"][0]["primitives"][0];
  const auto start = [&](const nlohmann::json& accessor) {
    const auto& view =
        json["bufferViews"][json["accessors"][accessor.get<int>()]["bufferView"].get<int>()];
    return bin + view["byteOffset"].get<std::size_t>();
  };
  const std::size_t points = start(primitive["attributes"]["POSITION"]),
                    normals = start(primitive["attributes"]["NORMAL"]),
                    corners = start(primitive["indices"]);
  ASSERT_EQ(json["accessors"][0]["count"], t.mesh.points.size());
  ASSERT_EQ(json["accessors"][2]["count"], 3 * t.mesh.triangles.size());
  for (std::size_t k = 0; k < t.mesh.points.size(); ++k) {
    const Vec3 lps = t.mesh.points[k], n = t.normals[k];
    for (int d = 0; d < 3; ++d) {
      const double x = At<float>(glb, points + 12 * k + 4 * d);
      EXPECT_NEAR(x, Vec3(lps.x(), lps.z(), -lps.y())[d] / 1000, 1e-7);
      EXPECT_GE(x, json["accessors"][0]["min"][d].get<double>());
      EXPECT_LE(x, json["accessors"][0]["max"][d].get<double>());
      EXPECT_NEAR(At<float>(glb, normals + 12 * k + 4 * d), Vec3(n.x(), n.z(), -n.y())[d], 1e-6);
    }
  }
  for (std::size_t k = 0; k < t.mesh.triangles.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_EQ(At<std::uint32_t>(glb, corners + 12 * k + 4 * c),
                static_cast<std::uint32_t>(t.mesh.triangles[k][c]));
    }
  }
}

TEST(FaceExport, AMeshThatGlTfCannotHoldIsRefused) {
  EXPECT_THROW(TessellationToGlb({}), InputError);
  Tessellation t = TessellateToChord(RandomSurface(kShape, 4), 1);
  t.normals.pop_back();
  EXPECT_THROW(TessellationToGlb(t), InputError);
}

}  // namespace
}  // namespace semblance::surfaces
