// SPDX-License-Identifier: GPL-3.0-or-later
// Laws that every reader of meshes obeys, and each fault with its words.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cctype>
#include <cstdlib>
#include <new>
#include <random>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_obj.h"
#include "surfaces/mesh_files/read_off.h"
#include "surfaces/mesh_files/read_ply.h"
#include "surfaces/mesh_files/read_stl.h"
#include "tests/testing/shapes.h"

namespace {
std::size_t largest_allocation = 0;  // bytes, since it was last set to 0
}  // namespace

// Not inlined, or g++ takes them for mismatched.
[[gnu::noinline]] void* operator new(std::size_t size) {
  largest_allocation = std::max(largest_allocation, size);
  void* memory = std::malloc(size);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace semblance::surfaces {
namespace {

using ::testing::HasSubstr;
using testing::Plate;
using testing::SphereMesh;

TriMesh Read(const std::string& extension, std::string_view bytes) {
  return extension == ".ply"   ? ReadPly(bytes, "a.ply")
         : extension == ".obj" ? ReadObj(bytes, "a.obj")
         : extension == ".off" ? ReadOff(bytes, "a.off")
                               : ReadStl(bytes, "a.stl");
}

std::string ErrorOf(const std::string& extension, std::string_view bytes) {
  try {
    Read(extension, bytes);
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

bool IsSound(const TriMesh& mesh) {
  const auto count = static_cast<std::int32_t>(mesh.points.size());
  return std::all_of(mesh.points.begin(), mesh.points.end(),
                     [](const Vec3& p) { return p.allFinite(); }) &&
         std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
           return std::all_of(t.begin(), t.end(),
                              [&](std::int32_t v) { return v >= 0 && v < count; });
         });
}

// A sphere with bumps, its coordinates single precision.
TriMesh BumpySphere(unsigned random_seed, int rings) {
  std::mt19937 random(random_seed);
  std::uniform_real_distribution<double> factor(0.9, 1.1);
  TriMesh mesh = SphereMesh({0, 0, 0}, 100, rings);
  for (Vec3& p : mesh.points) {
    p = (p * factor(random)).cast<float>().cast<double>();
  }
  return mesh;
}

std::string PlyText(const std::string& format, const std::string& body,
                    const std::string& type = "float") {
  return "ply\nformat " + format + " 1.0\nelement vertex 3\nproperty " + type + " x\nproperty " +
         type + " y\nproperty " + type +
         " z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" + body;
}

template <class T>
std::string Raw(T value, bool big_endian) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (big_endian) {
    std::reverse(raw.begin(), raw.end());
  }
  return {raw.begin(), raw.end()};
}

template <class T>
std::string PlyBody(const std::vector<T>& coordinates, bool big_endian) {
  std::string body;
  for (const T x : coordinates) {
    body += Raw(x, big_endian);
  }
  body += Raw(std::uint8_t{3}, big_endian);
  for (const std::int32_t v : {0, 1, 2}) {
    body += Raw(v, big_endian);
  }
  return body;
}

const std::string kTextPly = PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
const std::string kObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1.5e1 1\nf 1/1 2/2/2 3//3\nf -4 -3 -2 -1\n";
const std::string kOff = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n0 1 1\n3 0 1 2\n4 0 1 2 3 0.5 0.5 0.5\n";
const std::string kTextStl =
    "solid a b\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    "endloop\nendfacet\nendsolid a b\n";

// One small valid file of every form.
std::vector<std::pair<std::string, std::string>> ValidFiles() {
  const std::vector<float> x = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const TriMesh sphere = BumpySphere(1, 3);
  MeshAttributes attributes;
  attributes.scalars = {{"quality", std::vector<double>(sphere.points.size(), 1)}};
  return {{".ply", EncodeMesh(sphere, ".ply", attributes)},
          {".ply", kTextPly},
          {".ply", PlyText("binary_big_endian", PlyBody(x, true))},
          {".obj", kObj},
          {".obj", EncodeMesh(sphere, ".obj")},
          {".off", kOff},
          {".off", EncodeMesh(sphere, ".off")},
          {".stl", kTextStl},
          {".stl", EncodeMesh(sphere, ".stl")}};
}

TEST(MeshReaders, EveryMeshRoundTripsInEveryFormat) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const TriMesh mesh = BumpySphere(seed, 2 + static_cast<int>(seed));
    for (const std::string extension : {".ply", ".obj", ".off", ".stl"}) {
      const TriMesh read = Read(extension, EncodeMesh(mesh, extension));
      ASSERT_EQ(read.points.size(), mesh.points.size()) << extension;
      ASSERT_EQ(read.triangles.size(), mesh.triangles.size()) << extension;
      for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (std::size_t c = 0; c < 3; ++c) {
          EXPECT_EQ(read.points[read.triangles[t][c]], mesh.points[mesh.triangles[t][c]])
              << extension;
        }
      }
    }
  }
}

TEST(MeshReaders, AnyTrianglesRoundTripInPly) {
  std::mt19937 random(7);
  TriMesh mesh = BumpySphere(2, 4);
  std::uniform_int_distribution<std::int32_t> vertex(
      0, static_cast<std::int32_t>(mesh.points.size()) - 1);
  for (Triangle& t : mesh.triangles) {
    t = {vertex(random), vertex(random), vertex(random)};
  }
  const TriMesh read = ReadPly(EncodeMesh(mesh, ".ply"), "a.ply");
  EXPECT_EQ(read.points, mesh.points);
  EXPECT_EQ(read.triangles, mesh.triangles);
}

TEST(MeshReaders, APlySaysTheSameInEveryFormAndDoublesKeepTheirDigits) {
  const std::vector<double> x = {0.1, 0.2, 0.3, 1, 1e-9, 1e9, -7, 3.000000001, 0};
  const std::vector<Vec3> expected = {{0.1, 0.2, 0.3}, {1, 1e-9, 1e9}, {-7, 3.000000001, 0}};
  const auto points = [](const std::string& bytes) { return ReadPly(bytes, "a.ply").points; };
  EXPECT_EQ(points(PlyText("binary_little_endian", PlyBody(x, false), "double")), expected);
  EXPECT_EQ(points(PlyText("binary_big_endian", PlyBody(x, true), "double")), expected);
  EXPECT_EQ(
      points(PlyText("ascii", "0.1 0.2 .3\n\n+1 1e-9 1e9\n-7 3.000000001 0\r\n3 0 1 2", "double")),
      expected);
  EXPECT_EQ(points(PlyText("ascii", "0.1 0 0\n1e-60 0 0\n0 0 0\n3 0 1 2\n"))[0].x(),
            static_cast<double>(0.1f));
}

TEST(MeshReaders, OtherElementsPropertiesAndListsOfAPlyArePassedOver) {
  const TriMesh mesh = ReadPly(
      "ply\r\nformat ascii 1.0\r\ncomment a\r\nobj_info b\r\nelement none 2000000000\r\n"
      "element face 1\r\nproperty uchar red\r\nproperty list uint8 uint vertex_index\r\n"
      "property list int float uv\r\nelement vertex 4\r\nproperty list uchar float w\r\n"
      "property short z\r\nproperty double y\r\nproperty float x\r\nend_header\r\n"
      "255 4 0 1 2 3 2 0.5 nan\r\n0 1 2 3\r\n1 9 4 5 6\r\n0 7 8 9\r\n0 0 0 0\r\n",
      "a.ply");
  EXPECT_EQ(mesh.points, (std::vector<Vec3>{{3, 2, 1}, {6, 5, 4}, {9, 8, 7}, {0, 0, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
}

TEST(MeshReaders, AScalarOfAPlyIsReadInEveryForm) {
  const TriMesh plate = Plate(10, 1);
  MeshAttributes attributes;
  attributes.scalars = {{"a", {1, 2, 3, 4}}, {"depth", {0.5, -1, kNaN, 1e30f}}};
  const auto values = ReadPlyVertexScalar(EncodeMesh(plate, ".ply", attributes), "depth", "a.ply");
  EXPECT_THAT(values, ::testing::Pointwise(::testing::NanSensitiveDoubleEq(),
                                           {0.5, -1., kNaN, static_cast<double>(1e30f)}));
  EXPECT_EQ(ReadPlyVertexScalar(kTextPly, "y", "a.ply"), (std::vector<double>{0, 0, 1}));
  EXPECT_THAT([&] { ReadPlyVertexScalar(kTextPly, "q", "a.ply"); },
              ::testing::ThrowsMessage<InputError>("a.ply: a vertex has no 'q'; it has x, y, z"));
}

TEST(MeshReaders, ColoursOfATextPlyAreBytesOrRefused) {
  const auto read = [](const std::string& red) {
    return ReadPlyAttributes(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        "element face 0\nproperty list uchar int vertex_indices\nend_header\n0 0 0 " +
            red + " 1 2\n",
        "a.ply");
  };
  EXPECT_EQ(read("255").colors.at(0)[0], 255);
  for (const std::string wrong : {"256", "-1", "0.5", "nan", "1e99"}) {
    EXPECT_THAT([&] { read(wrong); },
                ::testing::ThrowsMessage<InputError>(::testing::AllOf(
                    HasSubstr("a.ply: line 13: vertex 0 has a colour of "), HasSubstr("0 to 255"))))
        << wrong;
  }
}

TEST(MeshReaders, AnObjWithItsLooks) {
  const ObjFile obj = ReadObjFile(
      "mtllib my skin #1.mtl \nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0.5 0 0.25\nvt 0.25 0.5 1\n"
      "f 1/1 2 2/-1 3\nusemtl the skin#2 \nvt 0.75\nf 1/2/7 2/1 3//4\n",
      "a.obj");
  EXPECT_EQ(obj.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}}));
  EXPECT_EQ(obj.libraries, std::vector<std::string>{"my skin #1.mtl"});
  EXPECT_EQ(obj.texture, (std::vector<Vec2>{{0.25, 0.5}, {0.75, 0}}));
  EXPECT_EQ(obj.colours, (std::vector<Vec3>{{1, 0, 0}, {0, 1, 0}, {0.5, 0, 0.25}}));
  ASSERT_EQ(obj.polygons.size(), 2u);
  EXPECT_EQ(obj.polygons[0].material, "");
  EXPECT_EQ(obj.polygons[1].material, "the skin#2");
  std::vector<std::pair<int, int>> corners;
  for (const ObjPolygon& polygon : obj.polygons) {
    for (const ObjPolygonCorner& corner : polygon.corners) {
      corners.emplace_back(corner.point, corner.texture);
    }
  }
  EXPECT_EQ(corners, (std::vector<std::pair<int, int>>{
                         {0, 0}, {1, -1}, {1, 0}, {2, -1}, {0, 1}, {1, 0}, {2, -1}}));
}

TEST(MeshReaders, AnObjWithItsLooksIsReadStrictly) {
  const std::string points = "v 0 0 0\nv 1 0 0 1 1 1\nv 0 1 0\n";
  EXPECT_TRUE(ReadObjFile(points + "f 1 2 3\n", "a.obj").colours.empty());
  for (const auto& [more, message] :
       {std::pair("f 1/0 2 3\n", "a.obj: line 4: a face names texture coordinate 0"),
        std::pair("f 1/-1 2 3\nvt 0 0\n", "line 4: a face names texture coordinate -1"),
        std::pair("vt 0 0\nf 1/2 2 3\n",
                  "line 5: a face names texture coordinate 2; the file has 1"),
        std::pair("vt nan 0\n", "line 4: a texture coordinate is not finite"),
        std::pair("vt\n", "line 4: a number is missing")}) {
    try {
      ReadObjFile(points + more, "a.obj");
      ADD_FAILURE() << more;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), HasSubstr(message));
    }
  }
}

TEST(MeshReaders, RelativeAndLaterVerticesOfAnObj) {
  EXPECT_EQ(Read(".obj", kObj).triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(Read(".obj", "f 1 2 3\nv 0 0 0\nv 1 0 0 1\nv 0 1 0 0.1 0.2 0.3\nf -1 -2 -3\nv 5 5 5\n")
                .triangles,
            (std::vector<Triangle>{{0, 1, 2}, {2, 1, 0}}));
  EXPECT_EQ(Read(".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\nf 1 2 2 3 1\n").triangles,
            (std::vector<Triangle>{{0, 1, 2}}));
}

TEST(MeshReaders, ALineOfAnObjMayGoOnAfterABackslash) {
  const TriMesh mesh = Read(".obj",
                            "# a comment ends with its line \\\nv 0 0 \\\n  0\nv 1 \\\r\n 0 \\\n0\n"
                            "v 0 1 0\nf 1 \\\n\\\n 2 3");
  EXPECT_EQ(mesh.points, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(ErrorOf(".obj", "v 0 0 \\\n0\nv 1 \\\n0 \\\nx\n").substr(0, 14), "a.obj: line 5:");
  EXPECT_EQ(ErrorOf(".obj", "v 0 0 \\\n0\nv 1 x \\\n0\n").substr(0, 14), "a.obj: line 3:");
  EXPECT_EQ(ErrorOf(".obj", "v 0 0 0\nv \\\n1 0 0\nx 3\n").substr(0, 14), "a.obj: line 4:");
}

// Spreadsheets and editors write a byte order mark, old Macs end lines with a carriage return.
TEST(MeshReaders, AByteOrderMarkAndTheEndsOfLinesDoNotMatter) {
  for (const auto& [extension, bytes] : ValidFiles()) {
    if (bytes.find('\0') != std::string::npos) {
      continue;
    }
    const TriMesh plain = Read(extension, bytes);
    std::string mac = bytes, windows;
    std::ranges::replace(mac, '\n', '\r');
    for (const char c : bytes) {
      windows += c == '\n' ? "\r\n" : std::string(1, c);
    }
    for (const std::string& other : {mac, windows, "\xEF\xBB\xBF" + bytes}) {
      EXPECT_EQ(Read(extension, other).points, plain.points) << extension;
      EXPECT_EQ(Read(extension, other).triangles, plain.triangles) << extension;
    }
  }
  EXPECT_THAT(ErrorOf(".obj", "v 0 0 0\rv 1 0 0\rv x 1 0\r"), HasSubstr("a.obj: line 3: 'x'"));
}

TEST(MeshReaders, TheStripsOfAPlyAreTriangles) {
  const auto strips = [](const std::string& rows, const std::string& more = "") {
    return "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty "
           "float z\nelement tristrips " +
           std::string(1, rows[0]) + "\nproperty list int int vertex_indices\n" + more +
           "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n" + rows.substr(1);
  };
  const std::vector<Triangle> expected = {{0, 1, 2}, {2, 1, 3}, {2, 3, 4}};
  EXPECT_EQ(Read(".ply", strips("15 0 1 2 3 4\n")).triangles, expected);
  EXPECT_EQ(Read(".ply", strips("18 0 1 2 3 4 -1 0 1\n")).triangles, expected) << "a strip of two";
  EXPECT_EQ(Read(".ply", strips("19 0 1 2 3 -1 2 3 4 -1\n")).triangles, expected);
  EXPECT_EQ(Read(".ply", strips("24 0 1 2 3\n3 2 3 4\n")).triangles, expected);
  EXPECT_EQ(Read(".ply", strips("18 0 1 2 2 3 3 4 4\n")).triangles.size(), 1u)
      << "equal corners make no triangle";
  EXPECT_EQ(Read(".ply", strips("13 0 1 2\n3 1 3 2\n",
                                "element face 1\nproperty list uchar int vertex_indices\n"))
                .triangles,
            (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_THAT(ErrorOf(".ply", strips("13 0 1 5\n")),
              HasSubstr("strip 0 names vertex 5; there are 5, numbered from 0"));
  EXPECT_THAT(ErrorOf(".ply", strips("14 0 1 -2 3\n")), HasSubstr("strip 0 names vertex -2"));
}

// A polygon's area by the shoelace formula is an oracle: triangles that cover it once have the same
// area, and a fan of a concave polygon has more.
TEST(MeshReaders, PolygonsAreCoveredOnceAlsoIfTheyAreConcave) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> radius(0.2, 1), angle(0, 6.28);
  for (int n = 4; n < 60; ++n) {
    std::vector<Vec2> corners;  // star-shaped about the origin, seldom convex
    for (int k = 0; k < n; ++k) {
      const double phi = 2 * 3.14159265358979 * k / n, r = radius(random);
      corners.emplace_back(r * std::cos(phi), r * std::sin(phi));
    }
    double expected = 0;
    for (int k = 0; k < n; ++k) {
      const Vec2 &a = corners[k], &b = corners[(k + 1) % n];
      expected += (a.x() * b.y() - a.y() * b.x()) / 2;
    }
    const Eigen::AngleAxisd turn(angle(random), Vec3(1, 2, 3).normalized());
    std::string points, face;
    for (int k = 0; k < n; ++k) {
      const Vec3 p = 100 * (turn * Vec3(corners[k].x(), corners[k].y(), 0));
      points += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
      face += fmt::format(" {}", k + 1);
    }
    const TriMesh mesh = Read(".obj", "f" + face + "\n" + points);
    ASSERT_EQ(mesh.triangles.size(), static_cast<std::size_t>(n - 2));
    EXPECT_NEAR(Area(mesh), 1e4 * expected, 1e-2) << n;
    const Vec3 normal = turn * Vec3::UnitZ();
    EXPECT_TRUE(std::ranges::all_of(mesh.triangles, [&](const Triangle& t) {
      return TriangleAreaVector(mesh, t).dot(normal) > -1e-3;
    })) << "turned over";
  }
}

TEST(MeshReaders, AConcaveQuadIsTheSameInEveryFormat) {
  // An arrowhead whose concave corner is the third: the fan of the first corner is right, and that
  // of the second covers the dent.
  const std::string points = "0 0 0\n4 0 0\n1 1 0\n0 4 0\n";
  const TriMesh off = Read(".off", "OFF\n4 1 0\n" + points + "4 1 2 3 0\n");
  EXPECT_NEAR(Area(off), 4, 1e-12);
  const TriMesh ply =
      Read(".ply",
           "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n"
           "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "end_header\n4 1 2 3 0\n" +
               points);
  EXPECT_EQ(ply.triangles, off.triangles);
  EXPECT_NEAR(Area(Read(".off", "OFF\n4 1 0\n" + points + "4 0 1 2 3\n")), 4, 1e-12);
}

TEST(MeshReaders, AHugeConcavePolygonIsRefused) {
  std::string points, face;
  for (int k = 0; k < 1001; ++k) {
    points += fmt::format("v {} {} 0\n", k, k % 2 == 0 ? 0 : 1);
    face += fmt::format(" {}", k + 1);
  }
  EXPECT_THAT(ErrorOf(".obj", points + "v 500 900 0\nf" + face + " 1002\n"),
              HasSubstr("a.obj: a face of 1002 corners that is not convex; triangulate the mesh"));
}

TEST(MeshReaders, VariantsOfOff) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (const std::string text :
       {"OFF\n# a comment\n3 1 0\n0 0 0 # here\n\n1 0 0\n0 1 0\n3 0 1 2\n",
        "# first\nOFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 7\n",
        "OFF3 1\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255 0 0 255",
        "COFF\n3 1 3\n0 0 0 255 0 0\n1 0 0 1 2 3 4\n0 1 0 0.1 0.2 0.3 1\n3 0 1 2\n",
        "NOFF\n3 1 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n3 0 1 2\n",
        "STCNOFF\n3 1 3\n0 0 0 1 2 3 4 0 0 1 9 9\n1 0 0 1 2 3 0 0 1 9 9\n0 1 0 1 2 3 0 0 1 9 9\n3 "
        "0 "
        "1 2\n"}) {
    EXPECT_EQ(Read(".off", text).points, points) << text;
    EXPECT_EQ(Read(".off", text).triangles, (std::vector<Triangle>{{0, 1, 2}})) << text;
  }
}

TEST(MeshReaders, AnStlIsWeldedInOrderOfFirstUse) {
  const std::string facet = "FACET NORMAL nan nan nan OUTER LOOP\n";
  const TriMesh mesh = Read(
      ".stl", "solid\n" + facet + "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop endfacet\n" +
                  facet + "vertex 0 1 0\nvertex 1 0 0\nvertex -0 1 5\nendloop\nendfacet\n" + facet +
                  "vertex 7 7 7\nvertex 7 7 7\nvertex -0 -0 0\nendloop\nendfacet\nendsolid\n"
                  "solid 2\n" +
                  facet + "vertex 7 7 7\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\nendsolid");
  EXPECT_EQ(mesh.points,
            (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 5}, {7, 7, 7}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {4, 0, 1}}));
}

TEST(MeshReaders, ATextStlMayBeInCapitals) {
  std::string capitals = kTextStl;
  std::ranges::transform(capitals, capitals.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  EXPECT_EQ(Read(".stl", capitals).points, Read(".stl", kTextStl).points);
  EXPECT_EQ(Read(".stl", capitals).triangles, Read(".stl", kTextStl).triangles);
}

TEST(MeshReaders, ABinaryStlMayBeginWithSolid) {
  for (const char* begin : {"solid facet ", "SOLID FACET "}) {
    std::string bytes = EncodeMesh(Plate(10, 1), ".stl");
    bytes.replace(0, 12, begin);
    EXPECT_EQ(Read(".stl", bytes).triangles.size(), 2u);
  }
}

// Every beginning of a file is read or refused; of a binary file it is refused.
TEST(MeshReaders, EveryPrefixIsReadOrRefused) {
  for (const auto& [extension, bytes] : ValidFiles()) {
    ASSERT_EQ(ErrorOf(extension, bytes), "accepted") << bytes;
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::string_view prefix = std::string_view(bytes).substr(0, size);
      const bool binary = bytes.find('\0') != std::string::npos;
      if (binary) {
        EXPECT_NE(ErrorOf(extension, prefix), "accepted") << extension << " " << size;
      } else if (ErrorOf(extension, prefix) == "accepted") {
        EXPECT_TRUE(IsSound(Read(extension, prefix)));
      }
    }
  }
}

TEST(MeshReaders, EveryDamageIsReadOrRefusedWithoutMuchMemory) {
  std::mt19937 random(11);
  for (const auto& [extension, bytes] : ValidFiles()) {
    std::uniform_int_distribution<std::size_t> at(0, bytes.size() - 1);
    std::uniform_int_distribution<int> letter(0, 255), flips(1, 3);
    for (int trial = 0; trial < 2000; ++trial) {
      std::string damaged = bytes;
      for (int k = flips(random); k > 0; --k) {
        damaged[at(random)] = static_cast<char>(letter(random));
      }
      largest_allocation = 0;
      try {
        EXPECT_TRUE(IsSound(Read(extension, damaged)));
      } catch (const InputError&) {
      }
      EXPECT_LE(largest_allocation, 24 * bytes.size() + 4096) << extension;
    }
  }
}

struct Fault {
  std::string extension, bytes, message;
};

std::string WithFace(const std::string& face) { return "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + face; }
std::string PlyHead(const std::string& lines) {
  return "ply\nformat ascii 1.0\n" + lines + "\nend_header\n";
}
std::string OffBody(const std::string& body) { return "OFF\n3 1 0\n0 0 0\n1 0 0\n" + body; }
std::string StlFacet(const std::string& vertices) {
  return "solid\nfacet normal 0 0 1\nouter loop\n" + vertices + "endloop\nendfacet\nendsolid\n";
}

TEST(MeshReaders, EveryFaultIsNamedWithItsPlace) {
  const std::string nan_stl = [] {
    TriMesh bad = Plate(10, 1);
    bad.points[0].x() = kNaN;
    return EncodeMesh(bad, ".stl");
  }();
  const std::vector<float> x = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::string binary = PlyText("binary_little_endian", PlyBody(x, false));
  std::string far_index = binary;
  far_index.replace(far_index.size() - 4, 4, "\x03\0\0\0", 4);
  const std::vector<Fault> faults = {
      // PLY: header
      {".ply", "", "a.ply: line 0: a PLY file begins with the line 'ply'"},
      {".ply", "plyx\n", "line 1: a PLY file begins"},
      {".ply", "ply\nformat ascii 2.0\n", "line 2: expected once: 'format ascii 1.0'"},
      {".ply", "ply\nelement vertex 3\nend_header\n", "the header has no line 'format'"},
      {".ply", PlyHead("property float x"), "line 3: a property before any element"},
      {".ply", PlyHead("element vertex"), "line 3: the number of elements is missing"},
      {".ply", PlyHead("element vertex -1"), "line 3: '-1' cannot be the number of elements"},
      {".ply", PlyHead("element vertex 4e9"), "line 3: '4e9' cannot be the number of elements"},
      {".ply", PlyHead("element vertex 18446744073709551615"), "from 0 to 2147483647"},
      {".ply", PlyHead("element vertex 2000000000\nproperty float x"), "at least 4000000000 bytes"},
      {".ply", PlyHead("element vertex 0\nproperty quad x"),
       "'quad' is not the type of a property"},
      {".ply", PlyHead("element vertex 0\nproperty list float int x"), "of a whole type"},
      {".ply", PlyHead("element vertex 0\nproperty int x\nproperty int x"),
       "line 5: the name 'x' is empty or taken"},
      {".ply", PlyHead("element vertex 0\nelement vertex 0"),
       "line 4: the name 'vertex' is empty or taken"},
      {".ply", PlyHead("elephant vertex 0"), "line 3: 'elephant' is not a keyword"},
      {".ply", PlyHead("element vertex 0 0"), "line 3: '0' is more than this line may hold"},
      {".ply", PlyHead("element vertex 0\nproperty int x"), "no element 'face'"},
      {".ply", PlyHead("element vertex 0\nproperty int x\nelement face 0"), "property 'y'"},
      {".ply",
       PlyHead("element vertex 0\nproperty int x\nproperty int y\nproperty int z\n"
               "element face 0\nproperty list uchar float vertex_indices"),
       "no list of whole numbers 'vertex_indices'"},
      // PLY: data
      {".ply", PlyText("ascii", "0 0 0\n1 0\n0 1 0\n3 0 1 2\n"), "line 11: a number is missing"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0 0\n0 1 0\n3 0 1 2\n"), "line 11: '0' is more than"},
      {".ply", PlyText("ascii", "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n"), "line 11: 'x' is not a number"},
      {".ply", PlyText("ascii", "0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"),
       "line 11: vertex 1 is not fin"},
      {".ply", PlyText("ascii", "0 0 0\n1 1e99 0\n0 1 0\n3 0 1 2\n"),
       "line 11: '1e99' is too large"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
       "line 13: face 0 names vertex 3"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
       "line 13: face 0 names vertex -1"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n3 0 1 .5\n"), "names vertex 0.5"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n3 0 1 nan\n"), "names vertex nan"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n-3 0 1 2\n"), "'vertex_indices' of -3 items"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n1e9 0 1 2\n"), "there is room for 3"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n2 0 1\n"), "face 0 has 2 corners"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0 1 0\n0         \n"), "face 0 has 0 corners"},
      {".ply", PlyText("ascii", "0 0 0\n1 0 0\n0         1 0\n"),
       "it ends after 0 of 1 of element"},
      {".ply", kTextPly + "3 0 1 2\n", "line 14: more data than the header says"},
      {".ply", binary + "x", "1 bytes more than the header says"},
      {".ply", far_index,
       "byte " + std::to_string(binary.size() - 4) + ": face 0 names vertex 3; there are 3"},
      // OBJ
      {".obj", "v 1\n", "a.obj: line 1: a number is missing"},
      {".obj", "v 1 2 nan\n", "line 1: a coordinate is not finite"},
      {".obj", "v 1 2 1e39\n", "line 1: '1e39' is too large"},
      {".obj", "v 1 2 3 4 5\n", "line 1: a vertex has 3, 4, 6 or 7 numbers, this has 5"},
      {".obj", "v 1 2 0x3\n", "line 1: '0x3' is not a number"},
      {".obj", WithFace("f\n"), "line 4: a face of 0 corners"},
      {".obj", WithFace("f 1 2\n"), "line 4: a face of 2 corners"},
      {".obj", WithFace("f 1 2 x\n"), "line 4: 'x' is not a corner"},
      {".obj", WithFace("f 1 2 3.0\n"), "line 4: '3.0' is not a corner"},
      {".obj", WithFace("f /3 -2 1\n"), "line 4: '/3' is not a corner"},
      {".obj", WithFace("f 1/a 2 3\n"), "line 4: '1/a' is not a corner"},
      {".obj", WithFace("f 1/1/1/1 2 3\n"), "line 4: '1/1/1/1' is not a corner"},
      {".obj", WithFace("f 0 1 2\n"), "line 4: a face names vertex 0"},
      {".obj", WithFace("f 1 2 -4\n"), "line 4: a face names vertex -4; allowed are"},
      {".obj", WithFace("f 1 2 4\n#\n"), "line 4: a face names vertex 4; the file has 3"},
      {".obj", WithFace("f 1 2 99999999999\n"), "line 4: a face names vertex 99999999999"},
      {".obj", WithFace("face 1 2 3\n"), "line 4: 'face' is not a keyword of a polygon mesh"},
      {".obj", std::string("\x80\x01v 0 0 0\n"), "line 1: '??v' is not a keyword"},
      // OFF
      {".off", "", "a.off: line 0: there is nothing to read"},
      {".off", "3 1 0\n", "line 1: '3' is not a header that is read"},
      {".off", "4OFF\n", "line 1: '4OFF' is not a header"},
      {".off", "OFF BINARY\n", "line 1: binary OFF is not read"},
      {".off", "OFF\n", "line 1: the file ends before its counts"},
      {".off", "OFF\n3\n", "line 2: the number of faces is missing"},
      {".off", "OFF\n-5 -5 0\n", "line 2: '-5' cannot be the number of vertices"},
      {".off", "OFF\n4000000000 4000000000 0\n", "'4000000000' cannot be the number of vertices"},
      {".off", "OFF\n2000000000 1 0\n", "need at least 12000000007 bytes, the file has 0 more"},
      {".off", OffBody("0 1\n3 0 1 2       \n"), "line 5: a number is missing"},
      {".off", OffBody("0 1 0 7\n3 0 1 2\n"), "line 5: a vertex of 4 numbers; by the header's"},
      {".off", OffBody("0 1 nan\n3 0 1 2\n"), "line 5: a coordinate is not finite"},
      {".off", OffBody("0 1 0\n2 0 1      \n"), "line 6: '2' cannot be the number of corners"},
      {".off", OffBody("0 1 0\n-3 0 1 2\n"), "line 6: '-3' cannot be the number of corners"},
      {".off", OffBody("0 1 0\n1000000000 0 1 2\n"), "line 6: the index of a vertex is missing"},
      {".off", OffBody("0 1 0\n3 0 1 3\n"), "line 6: '3' cannot be the index of a vertex; allowed"},
      {".off", OffBody("0 1 0\n3 0 1 x\n"), "line 6: 'x' cannot be the index of a vertex"},
      {".off", OffBody("0 1 0\n3 0 1 2 1 1 1 1 1\n"), "line 6: '1' is more than this line"},
      {".off", OffBody("0 1 0\n         "), "line 6: the file is truncated: it ends after 0 of 1"},
      {".off", kOff + "3 0 1 2\n", "line 9: more lines than the header says"},
      // STL
      {".stl", "", "a.stl: byte 0: the file is truncated: a binary STL has at least 84 bytes"},
      {".stl", "solid\n", "line 1: the file is truncated: it has no 'endsolid'"},
      {".stl", "solid\nfacet\n", "line 2: the file is truncated: it ends inside a facet"},
      {".stl", "solid\nvertex 0 0 0\n", "line 2: 'vertex' where 'facet' or 'endsolid' is expected"},
      {".stl", StlFacet(""), "line 4: 'endloop' where 'vertex' is expected"},
      {".stl", StlFacet("vertex 0 0 0\nvertex 1 0 0\n"), "line 6: 'endloop' where 'vertex'"},
      {".stl", StlFacet("vertex 0 0 0\nvertex 1 0\nvertex 0 1 0\n"), "line 5: a number is missing"},
      {".stl", StlFacet("vertex 0 0 0\nvertex 1 0 x\nvertex 0 1 0\n"),
       "line 5: 'x' is not a number"},
      {".stl", StlFacet("vertex 0 0 0\nvertex nan 0 0\nvertex 0 1 0\n"), "line 5: a coordinate"},
      {".stl", StlFacet("vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 1 1 0\n"),
       "line 7: 'vertex' where 'endloop' is expected"},
      {".stl", std::string(80, 'x') + "\xff\xff\xff\xff", "4294967295 triangles, that is"},
      {".stl", nan_stl, "byte 96: triangle 0: a coordinate is not finite"},
      {".stl", EncodeMesh(Plate(10, 1), ".stl") + "more",
       "the file is too long: its header says 2"},
  };
  for (const Fault& fault : faults) {
    const std::string error = ErrorOf(fault.extension, fault.bytes);
    EXPECT_THAT(error, HasSubstr(fault.message)) << fault.bytes;
    EXPECT_THAT(error, ::testing::StartsWith("a" + fault.extension + ": "));
    EXPECT_LT(error.size(), 400u);
  }
}

}  // namespace
}  // namespace semblance::surfaces
