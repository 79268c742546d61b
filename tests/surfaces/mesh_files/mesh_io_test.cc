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

// 3D Slicer states the axes in a comment of a PLY or OBJ, and in the words of an STL.
TEST_F(MeshIo, TheAxesThatAFileStatesAreRespected) {
  const TriMesh plate = Plate(10, 1);
  const auto ply = [&](const std::string& words) {
    std::string bytes = EncodeMesh(plate, ".ply");
    return bytes.insert(bytes.find("element vertex"), words);
  };
  const auto stl = [&](const std::string& words) {
    std::string bytes = EncodeMesh(plate, ".stl");
    return bytes.replace(0, words.size(), words);
  };
  const std::string obj = EncodeMesh(plate, ".obj"), off = EncodeMesh(plate, ".off");
  const std::string text_stl =
      "facet normal 0 0 1\nouter loop\nvertex 1 2 3\nvertex 4 2 3\nvertex 1 5 3\nendloop\n"
      "endfacet\nendsolid\n";
  const std::vector<std::pair<std::string, std::string>> ras = {
      {"a.ply", ply("comment 3D Slicer output. SPACE=RAS\n")},
      {"b.ply", ply("obj_info SPACE=Right-Anterior-Superior\ncomment x\n")},
      {"a.obj", "# 3D Slicer output. SPACE=RAS\n" + obj},
      {"b.obj", "mtllib a.mtl\r\n# SPACE=RAS;\r\no a\r\n" + obj},
      {"a.off", "# SPACE=RAS\n" + off},
      {"a.stl", stl("3D Slicer output. SPACE=RAS")},
      {"b.stl", stl("solid 3D Slicer output. SPACE=RAS")},
      {"c.stl", "solid 3D Slicer output. SPACE=RAS\n" + text_stl}};
  for (const auto& [name, bytes] : ras) {
    const auto path = Write(name, bytes);
    const MeshFile file = ReadMeshFile(path);
    EXPECT_EQ(file.axes, MeshAxes::kRas) << name;
    EXPECT_EQ(ReadStatedAxes(path), MeshAxes::kRas) << name;
    std::vector<std::string> notes;
    const TriMesh turned = ReadMeshInLps(path, notes);
    ASSERT_EQ(turned.points.size(), file.mesh.points.size());
    for (std::size_t v = 0; v < turned.points.size(); ++v) {
      const Vec3& p = file.mesh.points[v];
      EXPECT_EQ(turned.points[v], Vec3(-p.x(), -p.y(), p.z())) << name;
    }
    EXPECT_EQ(turned.triangles, file.mesh.triangles) << "a turn keeps the sides";
    EXPECT_EQ(notes, std::vector<std::string>{
                         name + ": the file states SPACE=RAS; turned to LPS (x and y negated)"});
    EXPECT_THAT(ErrorOf(path), HasSubstr(name + ": the file states SPACE=RAS, and this mesh must"));
  }
  const std::vector<std::pair<std::string, std::string>> others = {
      {"lps.ply", ply("comment SPACE=LPS\n")},
      {"lps.obj", "# SPACE=LPS\n" + obj},
      {"colour.ply", ply("comment COLORSPACE=RAS\n")},
      {"after.obj", obj + "# SPACE=RAS\n"},
      {"word.ply", ply("comment SPACE=linear\n")}};
  for (const auto& [name, bytes] : others) {
    std::vector<std::string> notes;
    EXPECT_EQ(ReadMeshInLps(Write(name, bytes), notes).points, plate.points) << name;
    EXPECT_TRUE(notes.empty()) << name;
    EXPECT_EQ(ReadStatedAxes(folder_ / name),
              name.starts_with("lps") ? MeshAxes::kLps : MeshAxes::kUnstated);
  }
}

TEST_F(MeshIo, OtherOrContradictingAxesAreRefused) {
  const std::string obj = EncodeMesh(Plate(10, 1), ".obj");
  EXPECT_THAT(ErrorOf(Write("las.obj", "# SPACE=LAS\n" + obj)),
              HasSubstr("las.obj: the file states SPACE=LAS; only LPS and RAS are read"));
  EXPECT_THAT(ErrorOf(Write("lsa.obj", "# SPACE=left-superior-anterior\n" + obj)),
              HasSubstr("the file states SPACE=LEFT-SUPERIOR-ANTERIOR; only"));
  EXPECT_THAT(
      ErrorOf(Write("both.obj", "# SPACE=LPS\n# SPACE=RAS\n" + obj)),
      HasSubstr("both.obj: the file states SPACE=LPS and SPACE=RAS; take the wrong line out"));
}

// The inputs that failed in the field: each is the same ball.
TEST_F(MeshIo, BallsOfTheFieldAreTheSame) {
  const std::filesystem::path field = SEMBLANCE_SOURCE_DIR "/../shared/data/field";
  if (!std::filesystem::exists(field)) {
    GTEST_SKIP() << "the inputs of the field are not here";
  }
  const auto volume = [](const TriMesh& mesh) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      sum += mesh.points[t[0]].dot(mesh.points[t[1]].cross(mesh.points[t[2]])) / 6;
    }
    return sum;
  };
  const TriMesh ball = ReadMesh(field / "ball-lps.ply");
  const double expected = volume(ball);
  EXPECT_GT(expected, 0);
  for (const char* name : {"ball-ras.ply", "bom.obj", "continued-lines.obj", "tristrips.ply"}) {
    std::vector<std::string> notes;
    const TriMesh mesh = ReadMeshInLps(field / name, notes);
    ASSERT_EQ(mesh.points.size(), ball.points.size()) << name;
    for (std::size_t v = 0; v < ball.points.size(); ++v) {
      EXPECT_LT((mesh.points[v] - ball.points[v]).norm(), 2e-3) << name;
    }
    EXPECT_NEAR(volume(mesh), expected, 1e-4 * expected) << name;
    EXPECT_EQ(notes.size(), std::string(name) == "ball-ras.ply" ? 1U : 0U);
  }
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
