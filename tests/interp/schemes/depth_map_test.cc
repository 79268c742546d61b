// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/depth_map.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "tests/testing/dowel_scenes.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::interp {
namespace {

using testing::Count;
using testing::FlatScene;
using ::testing::HasSubstr;
using testing::ScratchFolder;

class DepthMapTest : public ::testing::Test {
 protected:
  DepthMapTest() {
    for (const Vec3& p : scene_.skull.points) {
      depth_mm_.push_back(5 + p.x() / 8);  // exact in the file's float
    }
  }
  std::filesystem::path WritePly(const TriMesh& mesh, const std::vector<double>& depth_mm) {
    const auto path = folder_ / "map.ply";
    WriteFileAtomically(
        path, EncodeMesh(mesh, ".ply",
                         {.normals = {},
                          .colors = std::vector<std::array<std::uint8_t, 3>>(mesh.points.size()),
                          .scalars = {{"scalar_depth_mm", depth_mm}}}));
    return path;
  }
  std::filesystem::path WriteCsv(const std::string& text) {
    const auto path = folder_ / "map.csv";
    WriteFileAtomically(path, text);
    return path;
  }
  std::string CsvOf(const std::vector<double>& depth_mm) {
    std::string csv = "vertex,scalar_depth_mm\n";
    for (std::size_t v = 0; v < depth_mm.size(); ++v) {
      csv += std::isnan(depth_mm[v]) ? fmt::format("{},\n", v)
                                     : fmt::format("{},{}\n", v, depth_mm[v]);
    }
    return csv;
  }
  DepthField Field(const DepthMap& options) {
    return InterpolateDepth(options, scene_.Input(), RunContext{});
  }
  std::string ErrorOf(const DepthMap& options) {
    return testing::WordsOf<Error>([&] { Field(options); });
  }

  testing::DowelScene scene_ = FlatScene();
  std::vector<double> depth_mm_;
  ScratchFolder folder_;
};

TEST_F(DepthMapTest, GivesEachVertexItsOwnDepthFromAPlyOrACsv) {
  for (const DepthMap& options : {DepthMap{.file = WritePly(scene_.skull, depth_mm_)},
                                  DepthMap{.file = WriteCsv(CsvOf(depth_mm_))}}) {
    const DepthField field = Field(options);
    EXPECT_EQ(Count(field, DepthStatus::kAssigned), 441);
    for (std::size_t v = 0; v < depth_mm_.size(); ++v) {
      ASSERT_NEAR(field.depth_mm[v], depth_mm_[v], 1e-12);
    }
  }
}

TEST_F(DepthMapTest, IsLinearBetweenTheVerticesOfACoarserMesh) {
  const TriMesh coarse = testing::Plate(40, 4);
  std::vector<double> depth_mm;
  for (const Vec3& p : coarse.points) {
    depth_mm.push_back(5 + p.x() / 8);
  }
  const DepthField field = Field({.file = WritePly(coarse, depth_mm)});
  for (std::size_t v = 0; v < depth_mm_.size(); ++v) {
    ASSERT_NEAR(field.depth_mm[v], depth_mm_[v], 1e-12);
  }
  WriteFileAtomically(folder_ / "coarse.obj", EncodeMesh(coarse, ".obj"));
  const DepthField same =
      Field({.file = WriteCsv(CsvOf(depth_mm)), .mesh = folder_ / "coarse.obj"});
  EXPECT_NEAR(same.depth_mm[17], field.depth_mm[17], 1e-6);
}

TEST_F(DepthMapTest, IsUnassignedWhereTheMapHasNoneOrIsTooFar) {
  depth_mm_[0] = kNaN;
  DepthField field = Field({.file = WritePly(scene_.skull, depth_mm_)});
  EXPECT_EQ(field.status[0], DepthStatus::kOutside);
  EXPECT_TRUE(std::isnan(field.depth_mm[0]));
  EXPECT_EQ(Count(field, DepthStatus::kAssigned), 440);
  field = Field({.file = WriteCsv(CsvOf(depth_mm_))});
  EXPECT_EQ(Count(field, DepthStatus::kAssigned), 440);

  const TriMesh half = testing::Plate(20, 10);
  const DepthField far =
      Field({.file = WritePly(half, std::vector<double>(half.points.size(), 7)), .reach_mm = 0.5});
  for (std::size_t v = 0; v < depth_mm_.size(); ++v) {
    const Vec3& p = scene_.skull.points[v];
    EXPECT_EQ(far.status[v] == DepthStatus::kAssigned, p.x() <= 20 && p.y() <= 20);
  }
}

TEST_F(DepthMapTest, ReportsAFaultyFile) {
  EXPECT_EQ(ErrorOf({}), "depth_map: no file is named; give a PLY or CSV with a depth per vertex");
  EXPECT_THAT(ErrorOf({.file = "map.obj"}), HasSubstr("neither .ply nor .csv"));
  EXPECT_THROW(Field({.file = folder_ / "none.ply"}), IoError);
  const auto ply = WritePly(scene_.skull, depth_mm_);
  EXPECT_THAT(ErrorOf({.file = ply, .scalar = "depth"}),
              HasSubstr("a vertex has no 'depth'; it has x, y, z, red, green, blue, "
                        "scalar_depth_mm"));
  EXPECT_THAT(ErrorOf({.file = ply, .mesh = "skull.ply"}), HasSubstr("leave mesh empty"));
  depth_mm_[3] = -1;
  EXPECT_THAT(ErrorOf({.file = WritePly(scene_.skull, depth_mm_)}),
              HasSubstr("the depth of vertex 3 is -1 mm; it must be finite and above 0, or nan"));
  depth_mm_[3] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(
      ErrorOf({.file = WriteCsv(CsvOf(depth_mm_))}),
      HasSubstr("map.csv:5: column 'scalar_depth_mm': 'inf' is not a finite decimal number"));
  depth_mm_.pop_back();
  depth_mm_[3] = 4;
  EXPECT_THAT(ErrorOf({.file = WriteCsv(CsvOf(depth_mm_))}),
              HasSubstr("440 depths for 441 vertices of the skull (after fill)"));
  EXPECT_THAT(ErrorOf({.file = WriteCsv("depth\n1\n")}),
              HasSubstr("map.csv:1: there is no column 'scalar_depth_mm'; there are depth"));
  EXPECT_THAT(ErrorOf({.file = WriteCsv("scalar_depth_mm\n1\ntwo\n")}),
              HasSubstr("map.csv:3: column 'scalar_depth_mm': 'two' is not a finite"));
  EXPECT_THAT(ErrorOf({.file = WriteCsv("a,scalar_depth_mm\n1,2,3\n")}),
              HasSubstr("map.csv:2: 3 entries for 2 columns"));
}

TEST_F(DepthMapTest, ReadsPlyNumbersOfEveryTypeAndOrder) {
  const auto shape = [](const char* type) {
    return fmt::format(
        "element vertex 3\nproperty double x\nproperty {} depth\nproperty float y\nproperty float "
        "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
        type);
  };
  const auto text = folder_ / "text.ply";
  WriteFileAtomically(
      text,
      fmt::format("ply\nformat ascii 1.0\n{}0 3 0 0\n1 4 0 0\n0 5 1 0\n3 0 1 2\n", shape("uchar")));
  const testing::DowelScene corners = scene_.At({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  DepthField field =
      InterpolateDepth(DepthMap{.file = text, .scalar = "depth"}, corners.Input(), RunContext{});
  EXPECT_THAT(field.depth_mm, ::testing::ElementsAre(3, 4, 5));

  std::string bytes = fmt::format("ply\nformat binary_big_endian 1.0\n{}", shape("short"));
  const auto append = [&](const auto& value) {
    const char* raw = reinterpret_cast<const char*>(&value);
    for (std::size_t k = sizeof value; k-- > 0;) {
      bytes += raw[k];
    }
  };
  for (int v = 0; v < 3; ++v) {
    append(v == 1 ? 1.0 : 0.0);
    append(static_cast<std::int16_t>(300 + v));
    append(v == 2 ? 1.0f : 0.0f);
    append(0.0f);
  }
  append(std::uint8_t{3});
  for (std::int32_t v = 0; v < 3; ++v) {
    append(v);
  }
  WriteFileAtomically(text, bytes);
  field =
      InterpolateDepth(DepthMap{.file = text, .scalar = "depth"}, corners.Input(), RunContext{});
  EXPECT_THAT(field.depth_mm, ::testing::ElementsAre(300, 301, 302));
}

}  // namespace
}  // namespace semblance::interp
