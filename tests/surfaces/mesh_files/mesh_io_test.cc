// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/mesh_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <set>

#include "surfaces/base/error.h"
#include "tests/testing/shapes.h"

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;
using testing::Plate;
using testing::SphereMesh;

class MeshIo : public ::testing::Test {
 protected:
  MeshIo()
      : folder_(std::filesystem::temp_directory_path() /
                ("semblance_mesh_io_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~MeshIo() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  std::string ErrorOf(const std::filesystem::path& path) {
    try {
      ReadMesh(path);
    } catch (const Error& e) {
      return e.what();
    }
    return "accepted";
  }

  std::filesystem::path folder_;
};

TEST_F(MeshIo, EveryFormatRoundTrips) {
  const TriMesh sphere = SphereMesh({1, 2, 3}, 100, 12);
  for (const std::string extension : {".ply", ".obj", ".off", ".stl"}) {
    const TriMesh read = ReadMesh(Write("sphere" + extension, EncodeMesh(sphere, extension)));
    ASSERT_EQ(read.points.size(), sphere.points.size()) << extension;
    ASSERT_EQ(read.triangles.size(), sphere.triangles.size()) << extension;
    for (std::size_t t = 0; t < read.triangles.size(); ++t) {
      for (int c = 0; c < 3; ++c) {  // the same corners, whatever their numbers
        EXPECT_LT(
            (read.points[read.triangles[t][c]] - sphere.points[sphere.triangles[t][c]]).norm(),
            1e-4)
            << extension;
      }
    }
  }
}

// Law: at any place a mesh is read back to a fiftieth of its chord, and to 1e-4 mm.
TEST_F(MeshIo, FarFromTheOriginCoordinatesKeepTheirDigits) {
  const TriMesh sphere = SphereMesh({500000.1, 5400000.2, 300.3}, 100, 12);
  for (const std::string extension : {".ply", ".obj", ".off"}) {
    const TriMesh read = ReadMesh(Write("far" + extension, EncodeMesh(sphere, extension)));
    ASSERT_EQ(read.points.size(), sphere.points.size()) << extension;
    for (std::size_t p = 0; p < read.points.size(); ++p) {
      EXPECT_LT((read.points[p] - sphere.points[p]).norm(), 1e-4) << extension;
    }
    EXPECT_EQ(read.triangles, sphere.triangles) << extension;
  }
  const TriMesh head = SphereMesh({1, 2, -500}, 100, 12);
  EXPECT_THAT(EncodeMesh(head, ".ply"), HasSubstr("property float x"));
  EXPECT_THAT(EncodeMesh(head, ".ply", {}, 0.01), HasSubstr("property float x"));
  EXPECT_THAT(EncodeMesh(head, ".ply", {}, 0.001), HasSubstr("property double x"));
  const TriMesh small = SphereMesh({500, 0, 0}, 0.1, 12);
  EXPECT_THAT(EncodeMesh(small, ".ply"), HasSubstr("property double x"));
  const TriMesh huge = SphereMesh({0, 0, 0}, 1e50, 12);
  EXPECT_EQ(ReadMesh(Write("huge.ply", EncodeMesh(huge, ".ply"))).points, huge.points);
}

TEST_F(MeshIo, TextsOfAHeadHaveTheDigitsOfSinglePrecision) {
  const TriMesh mesh{.points = {{0.1, -0.1, 1e-12}, {1, 0, 1.0 / 3}, {0, 1, 300}},
                     .triangles = {{0, 1, 2}}};
  EXPECT_EQ(EncodeMesh(mesh, ".obj"),
            "# 3 vertices, 1 faces\nv 0.100000001 -0.100000001 9.99999996e-13\nv 1 0 "
            "0.333333343\nv 0 1 300\nf 1 2 3\n");
  EXPECT_EQ(EncodeMesh(mesh, ".off"),
            "OFF\n3 1 0\n0.100000001 -0.100000001 9.99999996e-13\n1 0 0.333333343\n0 1 300\n3 0 1 "
            "2 \n");
}

TEST_F(MeshIo, NonManifoldFacesAreKept) {
  TriMesh mesh = Plate(10, 1);
  mesh.points.emplace_back(5, 5, 5);
  mesh.triangles.push_back({0, 3, 4});  // a third triangle at the diagonal
  for (const std::string extension : {".ply", ".obj", ".off"}) {
    EXPECT_EQ(ReadMesh(Write("fin" + extension, EncodeMesh(mesh, extension))).triangles,
              mesh.triangles);
  }
  EXPECT_EQ(CheckEdges(mesh).non_manifold, 1);
  const TriMesh stl = ReadMesh(Write("fin.stl", EncodeMesh(mesh, ".stl")));
  EXPECT_EQ(stl.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(CheckEdges(stl).non_manifold, 1);
}

TEST_F(MeshIo, PlyCarriesColoursAndNamedScalars) {
  const TriMesh plate = Plate(10, 1);
  MeshAttributes attributes;
  attributes.colors.assign(4, {1, 2, 3});
  attributes.scalars = {{"quality", {0, 1, 2, 3}}, {"scalar_error_mm", {0, 1, kNaN, 3}}};
  const std::string bytes = EncodeMesh(plate, ".ply", attributes);
  EXPECT_THAT(bytes, HasSubstr("property uchar red\nproperty uchar green\nproperty uchar "
                               "blue\nproperty float quality\nproperty float scalar_error_mm\n"));
  EXPECT_EQ(ReadMesh(Write("a.ply", bytes)).points, plate.points);
  attributes.scalars[0].values.pop_back();
  EXPECT_THROW(EncodeMesh(plate, ".ply", attributes), InputError);
}

TEST_F(MeshIo, QuadsBecomeTriangles) {
  const auto path = Write("quad.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n");
  EXPECT_EQ(ReadMesh(path).triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST_F(MeshIo, EachDefectIsNamed) {
  const std::string ply = EncodeMesh(Plate(10, 2), ".ply");
  const std::string stl = EncodeMesh(Plate(10, 2), ".stl");
  EXPECT_THAT(ErrorOf(folder_ / "none.ply"), HasSubstr("none.ply: no such file"));
  EXPECT_THAT(ErrorOf(Write("empty.ply", "")), HasSubstr("empty.ply: the file is empty"));
  EXPECT_THAT(ErrorOf(Write("a.xyz", "1 2 3")),
              HasSubstr("'.xyz' is not a known mesh format; use .ply, .obj, .stl or .off"));
  EXPECT_THAT(ErrorOf(Write("cut.ply", ply.substr(0, ply.size() - 5))),
              HasSubstr("cut.ply: byte " + std::to_string(ply.size() - 13) +
                        ": a list 'vertex_indices' of 3 items, but there is room for 1; the file "
                        "is truncated or damaged"));
  EXPECT_THAT(ErrorOf(Write("cut2.ply", ply.substr(0, 60))),
              HasSubstr("cut2.ply: line 3: the file is truncated: its header has no 'end_header'"));
  EXPECT_THAT(
      ErrorOf(Write("cut.stl", stl.substr(0, stl.size() - 1))),
      HasSubstr(
          "the file is truncated: its header says 8 triangles, that is 484 bytes; it has 483"));
  EXPECT_THAT(ErrorOf(Write("text.ply", "hello")),
              HasSubstr("text.ply: line 1: a PLY file begins with the line 'ply'"));
  EXPECT_THAT(ErrorOf(Write("points.obj", "v 0 0 0\nv 1 0 0\n")),
              HasSubstr("points.obj: the mesh has no triangles"));
  TriMesh bad = Plate(10, 2);
  bad.points[3].y() = kNaN;
  EXPECT_THAT(ErrorOf(Write("nan.ply", EncodeMesh(bad, ".ply"))),
              HasSubstr(": vertex 3 is not finite"));
  TriMesh beyond = Plate(10, 1);
  beyond.triangles[0][0] = 77;
  EXPECT_THAT(ErrorOf(Write("index.ply", EncodeMesh(beyond, ".ply"))),
              HasSubstr("face 0 names vertex 77; there are 4, numbered from 0"));
}

// On these the readers of the past crashed, looped, or dropped what was wrong.
TEST_F(MeshIo, BrokenFilesAreRefusedOrRead) {
  const std::filesystem::path broken = SEMBLANCE_SOURCE_DIR "/../shared/data/broken";
  if (!std::filesystem::exists(broken)) {
    GTEST_SKIP() << "the collection of broken files is not here";
  }
  const std::set<std::string> valid = {"degenerate.ply", "far_1e15.ply", "off_comment.off",
                                       "off_comments.off"};
  const std::set<std::string> mesh_formats = {".ply", ".obj", ".off", ".stl"};
  for (const auto& entry : std::filesystem::directory_iterator(broken)) {
    const std::string name = entry.path().filename().string();
    if (mesh_formats.contains(entry.path().extension().string())) {
      EXPECT_EQ(ErrorOf(entry.path()) == "accepted", valid.contains(name)) << name;
    } else if (entry.path().extension().empty()) {  // from a fuzzer: any reader may meet it
      std::ifstream file(entry.path(), std::ios::binary);
      const std::string bytes(std::istreambuf_iterator<char>(file), {});
      for (const std::string& extension : mesh_formats) {
        EXPECT_NE(ErrorOf(Write("fuzzed" + extension, bytes)), "accepted") << name << extension;
      }
    }
  }
}

TEST_F(MeshIo, RealScansAreReadWhole) {
  const std::filesystem::path skull = SEMBLANCE_SOURCE_DIR "/../shared/data/vhm/skull.ply";
  if (!std::filesystem::exists(skull)) {
    GTEST_SKIP() << "the prepared real subjects are not here";
  }
  const TriMesh mesh = ReadMesh(skull);
  EXPECT_EQ(mesh.points.size(), 194942u);
  EXPECT_EQ(mesh.triangles.size(), 393818u);
}

}  // namespace
}  // namespace semblance::surfaces
