// SPDX-License-Identifier: GPL-3.0-or-later
// Law: the same points give the same table from every file format.
#include "problems/points/point_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::WordsOf;

constexpr int kCount = 12;

// Numbers that a float cannot hold.
Vec3 PointAt(int k) { return {k + 0.1, k * k / 7.0, -1.0 / (k + 3)}; }
Vec2 UvAt(int k) { return {k / 13.0, (kCount - k) / 17.0}; }

template <class Line>
std::string Lines(Line&& line) {
  std::string text;
  for (int k = 0; k < kCount; ++k) {
    text += line(PointAt(k), UvAt(k)) + "\n";
  }
  return text;
}

std::string Numbers(const Vec3& p, const char* between) {
  return fmt::format("{1}{0}{2}{0}{3}", between, p.x(), p.y(), p.z());
}

std::string Csv() {
  return "x,y,z\n" + Lines([](const Vec3& p, const Vec2&) { return Numbers(p, ","); });
}

std::string Npy(int columns) {
  std::string head = fmt::format("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}",
                                 kCount, columns);
  head.append(63 - (10 + head.size()) % 64, ' ');
  head += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(head.size() & 255);
  bytes += static_cast<char>(head.size() >> 8);
  bytes += head;
  for (int k = 0; k < kCount; ++k) {
    const Vec3 p = PointAt(k);
    const double row[5] = {p.x(), p.y(), p.z(), UvAt(k).x(), UvAt(k).y()};
    bytes.append(reinterpret_cast<const char*>(row), sizeof(double) * columns);
  }
  return bytes;
}

// A PLY with further properties of type double, `values` per vertex.
template <class Values>
std::string Ply(const std::vector<std::string>& properties, Values&& values,
                const std::string& faces = "") {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double "
      "y\nproperty double z\n",
      kCount);
  for (const std::string& property : properties) {
    text += fmt::format("property double {}\n", property);
  }
  if (!faces.empty()) {
    text += "element face 1\nproperty list uchar int vertex_indices\n";
  }
  text += "end_header\n";
  for (int k = 0; k < kCount; ++k) {
    text += fmt::format("{} {}\n", Numbers(PointAt(k), " "), values(k));
  }
  return text + faces;
}

std::string PlainPly(const std::string& faces = "") {
  return Ply(
      {}, [](int) { return ""; }, faces);
}

std::string OneScalarPly(const std::string& name, double value, double last) {
  return Ply({name}, [&](int k) { return fmt::format("{}", k + 1 < kCount ? value : last); });
}

std::string Obj(const std::string& faces = "") {
  return "# a comment\n" +
         Lines([](const Vec3& p, const Vec2&) { return "v " + Numbers(p, " "); }) + faces;
}

std::string Off() {
  return fmt::format("OFF\n{} 1 0\n", kCount) +
         Lines([](const Vec3& p, const Vec2&) { return Numbers(p, " "); }) + "3 0 1 2\n";
}

std::string Xyz() {
  return "# x y z\n" + Lines([](const Vec3& p, const Vec2&) { return Numbers(p, " "); });
}

class PointFiles : public ::testing::Test {
 protected:
  PointTable Read(const std::string& name, const std::string& bytes,
                  const std::vector<std::string>& attributes = {}) {
    WriteFileAtomically(folder_ / name, bytes);
    return ReadPointFile(folder_ / name, attributes).points;
  }

  std::string Refusal(const std::string& name, const std::string& bytes,
                      const std::vector<std::string>& attributes = {}) {
    return WordsOf<Error>([&] { Read(name, bytes, attributes); });
  }

  ScratchFolder folder_;
};

TEST_F(PointFiles, EveryFormatGivesTheSamePoints) {
  const std::map<std::string, std::string> files = {
      {"a.csv", Csv()},  {"a.txt", Csv()},      {"a.xyz", Xyz()},
      {"a.npy", Npy(3)}, {"a.ply", PlainPly()}, {"a.obj", Obj()},
      {"a.off", Off()},  {"A.XYZ", Xyz()},      {"b.obj", Obj("f 1 2 3\n")}};
  for (const auto& [name, bytes] : files) {
    SCOPED_TRACE(name);
    const PointTable table = Read(name, bytes);
    ASSERT_EQ(table.positions.size(), std::size_t{kCount});
    for (int k = 0; k < kCount; ++k) {
      const bool single = name.ends_with(".off");
      EXPECT_EQ(table.positions[k],
                single ? Vec3(PointAt(k).cast<float>().cast<double>()) : PointAt(k))
          << k;
    }
    EXPECT_TRUE(table.uv.empty());
    EXPECT_TRUE(table.weights.empty());
  }
}

// Tables of other programs: without names, with a count, as a grid.
TEST_F(PointFiles, FilesWithoutNamesHaveTheirCoordinatesFirst) {
  const std::vector<Vec3> points = {{1, 2, 3}, {-4, 5.5, 6}};
  for (const auto& [name, bytes] :
       std::map<std::string, std::string>{{"a.csv", "1,2,3,7\n-4,5.5,6,8\n"},
                                          {"b.csv", "1;2;3\n-4;5,5;6\n"},
                                          {"c.txt", "1 2 3\n-4 5.5 6\n"},
                                          {"d.pts", "2\n1 2 3 0 9 9 9\n-4 5.5 6 0 9 9 9\n"},
                                          {"e.asc", "1 2 3\n-4 5.5 6\n"}}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(Read(name, bytes).positions, points);
  }
  const std::string grid =
      "ncols 2\nnrows 2\nxllcorner 10\nyllcorner 20\ncellsize 2\nNODATA_value -9999\n"
      "1 2\n-9999 4\n";
  EXPECT_THAT(Read("g.asc", grid).positions,
              ::testing::ElementsAre(Vec3(11, 23, 1), Vec3(13, 23, 2), Vec3(13, 21, 4)));
  EXPECT_THAT(Refusal("h.asc", grid + "5\n"), HasSubstr("ncols"));
}

// A row that lost its last digits is a row all the same.
TEST_F(PointFiles, ATextThatWasCutInItsLastLineIsNoted) {
  const auto is_noted = [&](const std::string& file) {
    return ::testing::PrintToString(ReadPointFile(folder_ / file, {}).points.notes)
               .find("the last line has no end") != std::string::npos;
  };
  const std::string bare = Lines([](const Vec3& p, const Vec2&) { return Numbers(p, " "); });
  for (const auto& [file, text] :
       {std::pair("a.csv", Csv()), std::pair("a.txt", bare), std::pair("a.xyz", bare)}) {
    WriteFileAtomically(folder_ / file, text);
    EXPECT_FALSE(is_noted(file)) << file;
    WriteFileAtomically(folder_ / file, text.substr(0, text.size() - 3));
    EXPECT_TRUE(is_noted(file)) << file;
  }
}

TEST_F(PointFiles, ACompressedFileGivesTheSamePoints) {
  for (const auto& [name, bytes] : std::map<std::string, std::string>{
           {"a.csv", Csv()}, {"a.npy", Npy(5)}, {"a.ply", PlainPly()}, {"a.xyz", Xyz()}}) {
    SCOPED_TRACE(name);
    const PointTable plain = Read(name, bytes);
    const std::string path = (folder_ / name).string();
    ASSERT_EQ(std::system(("gzip -kf '" + path + "'").c_str()), 0);
    const PointTable zipped = ReadPointFile(path + ".gz").points;
    EXPECT_EQ(zipped.positions, plain.positions);
    EXPECT_EQ(zipped.uv, plain.uv);
  }
  EXPECT_THAT(Refusal("broken.csv.gz", "this is no gzip"), HasSubstr("broken.csv.gz"));
}

// Each byte of what gzip checks by, and each length that the file may be cut to.
TEST_F(PointFiles, DamagedCompressedFilesAreRefused) {
  WriteFileAtomically(folder_ / "a.csv", Csv());
  ASSERT_EQ(std::system(("gzip -kf '" + (folder_ / "a.csv").string() + "'").c_str()), 0);
  const std::string whole = ReadFileBytes(folder_ / "a.csv.gz");
  for (std::size_t k = whole.size() - 8; k < whole.size(); ++k) {
    std::string damaged = whole;
    damaged[k] = static_cast<char>(damaged[k] ^ 1);
    EXPECT_THAT(Refusal("b.csv.gz", damaged), HasSubstr("b.csv.gz: the file is cut short or"));
  }
  for (std::size_t size = 2; size < whole.size(); ++size) {
    EXPECT_THAT(Refusal("b.csv.gz", whole.substr(0, size)), HasSubstr("b.csv.gz: the file is cut"))
        << size;
  }
  EXPECT_EQ(Read("b.csv.gz", whole + "behind the last member").positions.size(), kCount);
}

// A square of two triangles, as programs write it that know no shared corners.
TEST_F(PointFiles, CornersInOnePlaceAreOnePoint) {
  const std::string soup =
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";
  const PointTable table = Read("soup.obj", soup);
  EXPECT_THAT(table.positions,
              ::testing::ElementsAre(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)));
  EXPECT_THAT(table.triangles, ::testing::ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
}

TEST_F(PointFiles, ParametersComeWithTheFormatsThatHaveThem) {
  const auto both = [](int k) { return fmt::format("{} {}", UvAt(k).x(), UvAt(k).y()); };
  for (const auto& [name, bytes] :
       std::map<std::string, std::string>{{"five.npy", Npy(5)},
                                          {"uv.ply", Ply({"u", "v"}, both)},
                                          {"st.ply", Ply({"s", "t"}, both)}}) {
    SCOPED_TRACE(name);
    const PointTable table = Read(name, bytes);
    ASSERT_EQ(table.uv.size(), std::size_t{kCount});
    for (int k = 0; k < kCount; ++k) {
      EXPECT_EQ(table.uv[k], UvAt(k)) << k;
    }
  }
}

TEST_F(PointFiles, FacesBecomeTrianglesBetweenThePoints) {
  for (const auto& [name, bytes] : std::map<std::string, std::string>{
           {"a.ply", PlainPly("3 0 1 2\n")}, {"a.obj", Obj("f 1 2 3\n")}, {"a.off", Off()}}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(Read(name, bytes).triangles, (std::vector<Triangle>{{0, 1, 2}}));
  }
}

TEST_F(PointFiles, EqualCornersOfAnStlAreOnePoint) {
  const PointTable table = Read("a.stl",
                                "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 "
                                "0\nvertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter "
                                "loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 "
                                "0\nendloop\nendfacet\nendsolid s\n");
  EXPECT_EQ(table.positions.size(), 4u);
  EXPECT_EQ(table.triangles.size(), 2u);
}

TEST_F(PointFiles, WeightAndSigmaOfAPlyAreThoseOfATable) {
  const PointTable weight = Read("w.ply", OneScalarPly("weight", 4, 4)),
                   sigma = Read("s.ply", OneScalarPly("sigma", 0.5, 0.5));
  EXPECT_FALSE(weight.weights_of_sigma);
  EXPECT_TRUE(sigma.weights_of_sigma);
  EXPECT_EQ(weight.weights, std::vector<double>(kCount, 4));
  EXPECT_EQ(sigma.weights, weight.weights);
  EXPECT_THAT(Refusal("both.ply", Ply({"weight", "sigma"}, [](int) { return "1 1"; })),
              HasSubstr("give one of them"));
  for (const char* bad : {"weight", "sigma"}) {
    EXPECT_THAT(Refusal("bad.ply", OneScalarPly(bad, 1, 0)),
                HasSubstr(fmt::format("the {} of point {} is not positive", bad, kCount)));
  }
}

// With the same numbers in the columns of the two.
TEST_F(PointFiles, ExactPointsOfAPlyAreThoseOfATable) {
  const auto values = [](int k) { return fmt::format("{} 0 0.5 {}", k % 5 == 0 ? 1 : 0, -k); };
  std::string csv = "x,y,z,exact,nx,ny,nz\n";
  for (int k = 0; k < kCount; ++k) {
    std::string row = Numbers(PointAt(k), " ") + " " + values(k) + "\n";
    std::ranges::replace(row, ' ', ',');
    csv += row;
  }
  const PointTable table = Read("a.csv", csv),
                   ply = Read("a.ply", Ply({"exact", "nx", "ny", "nz"}, values));
  EXPECT_EQ(ply.exact, (std::vector<std::uint32_t>{0, 5, 10}));
  EXPECT_EQ(ply.exact, table.exact);
  EXPECT_EQ(ply.exact_normals, table.exact_normals);
  const PointTable plain = Read("b.ply", OneScalarPly("exact", 0, 1));
  EXPECT_EQ(plain.exact, (std::vector<std::uint32_t>{kCount - 1}));
  EXPECT_EQ(plain.exact_normals, std::vector<Vec3>(1, Vec3::Zero()));
  EXPECT_THAT(Refusal("c.ply", OneScalarPly("exact", 0, 0.5)),
              HasSubstr(fmt::format("the exact of point {} is 0.5; write 1", kCount)));
  EXPECT_THAT(Refusal("d.ply", Ply({"exact", "nx"}, [](int) { return "1 1"; })),
              HasSubstr("give all three, or none"));
  EXPECT_TRUE(Read("e.ply", OneScalarPly("nx", 0, 1)).exact.empty()) << "a normal of a mesh";
}

TEST_F(PointFiles, APlyAndAnXyzRefuseWhatATableRefuses) {
  for (const char* lone : {"u", "v", "s", "t"}) {
    EXPECT_THAT(Refusal("lone.ply", OneScalarPly(lone, 0, 1)),
                HasSubstr(fmt::format("the vertices have '{}' without '", lone)));
  }
  const auto three = [](int) { return "0 0.5 1"; };
  EXPECT_EQ(Read("more.ply", Ply({"t", "u", "v"}, three)).uv.front(), Vec2(0.5, 1));
  EXPECT_THAT(Refusal("nan.ply", Ply({"u", "v"}, [](int k) { return k == 4 ? "0 nan" : "0 1"; })),
              HasSubstr("nan.ply: the v of point 5 is not finite"));
  EXPECT_THAT(Refusal("four.xyz", "1 2 3\n1 2 3 0.5\n"),
              HasSubstr("four.xyz: line 2: '0.5' follows x, y and z; leave it out, or give a CSV"));
}

TEST_F(PointFiles, APointIsNamedByItsFileAndLine) {
  EXPECT_EQ(PointName(Read("a.csv", Csv()), 3), (folder_ / "a.csv:5: point 4").string());
  EXPECT_EQ(PointName(Read("a.ply", PlainPly()), 3), (folder_ / "a.ply: point 4").string());
  EXPECT_EQ(PointName(PointTable(), 3), "point 4");
}

TEST_F(PointFiles, OnlyATableAndAPlyHaveAttributes) {
  const PointTable table = Read("a.ply", OneScalarPly("warmth", 3, 5), {"warmth"});
  ASSERT_EQ(table.attributes.size(), 1u);
  EXPECT_EQ(table.attributes[0].name, "warmth");
  EXPECT_EQ(table.attributes[0].values.back(), 5);
  EXPECT_THAT(Refusal("a.xyz", Xyz(), {"warmth"}), HasSubstr("'warmth'"));
  EXPECT_THAT(Refusal("b.ply", PlainPly(), {"warmth"}), HasSubstr("warmth"));
  EXPECT_THAT(Refusal("c.ply", OneScalarPly("warmth", 3, std::numeric_limits<double>::infinity()),
                      {"warmth"}),
              HasSubstr("c.ply: "));
}

TEST_F(PointFiles, ContentsOfAnotherFormatAreRefusedByName) {
  EXPECT_THAT(Refusal("a.pcd", "1 2 3"), HasSubstr("files of points end in"));
  EXPECT_THAT(Refusal("a.npy", Npy(4)), HasSubstr("neither n x 3"));
  EXPECT_THAT(Refusal("a.xyz", "1 2\n"), HasSubstr("a.xyz"));
  EXPECT_THAT(Refusal("b.xyz", "1 2 inf\n"), HasSubstr("b.xyz"));
  EXPECT_THAT(Refusal("d.xyz", "1 2 3\n1 -2e200 3\n"),
              HasSubstr("d.xyz: point 2 has a coordinate"));
  EXPECT_THAT(Refusal("d.csv", "x,y,z\n1,2e200,3\n"),
              HasSubstr("d.csv:2: point 1 has a coordinate"));
  EXPECT_THAT(Refusal("c.xyz", "# nothing\n"), HasSubstr("there is no point"));
  EXPECT_THAT(Refusal("a.obj", "v 1 2 nan\n"), HasSubstr("a.obj"));
  EXPECT_THAT(Refusal("b.obj", "vn 0 0 1\n"), HasSubstr("there is no point"));
  EXPECT_THAT(Refusal("c.obj", "v 1 2 3\nx,y,z\n"), HasSubstr("c.obj: line 2: 'x,y,z' is not a"));
  EXPECT_THAT(Refusal("d.obj", "v 1 2 3\nv 1 2\n"), HasSubstr("line 2: a number is missing"));
  EXPECT_THAT(Refusal("e.obj", "v 1 2 3 4 5\n"), HasSubstr("line 1: a vertex has 3, 4, 6 or 7"));
  EXPECT_THAT(Refusal("f.obj", "v 1 2 3 grey\n"), HasSubstr("line 1: 'grey' is not a number"));
  EXPECT_THAT(Refusal("g.obj", "v 1 2 3 0 nan 0\n"), HasSubstr("line 1: a number is not finite"));
  EXPECT_EQ(Read("h.obj", "o cloud\nv 1 2 3 0.5\nv 1 2 3 0 0.5 1\nvn 0 0 1\n").positions.size(),
            2u);
  EXPECT_THAT(Refusal("a.ply", "ply\nformat ascii 1.0\nend_header\n"), HasSubstr("a.ply"));
  EXPECT_THAT(WordsOf<Error>([&] { ReadPointFile(folder_ / "missing.csv"); }),
              HasSubstr("missing.csv"));
}

// Whole numbers in steps of one before x, y and z are no x. Three columns alone are x, y and z.
TEST_F(PointFiles, NumbersOfRowsBeforeTheCoordinatesAreRefused) {
  const auto rows = [](double first, int columns) {
    std::string text;
    for (int k = 0; k < 20; ++k) {
      text += fmt::format("{}", first + k);
      for (int c = 1; c < columns; ++c) {
        text += fmt::format(",{}", std::sin(k * c + 1.0));
      }
      text += "\n";
    }
    return text;
  };
  EXPECT_THAT(Refusal("a.csv", rows(0, 4)), HasSubstr("the first column counts from 0 to 19"));
  EXPECT_THAT(Refusal("b.csv", rows(1.7e9, 5)), HasSubstr("in steps of 1"));
  EXPECT_EQ(Read("c.csv", rows(0.5, 4)).positions.size(), 20u);
  EXPECT_EQ(Read("d.csv", rows(0, 3)).positions.size(), 20u);
}

TEST_F(PointFiles, SeparatorsOfThousandsAreRefused) {
  EXPECT_THAT(Refusal("a.csv", "x;y;z\n12,345;1;2\n678;3;4\n"),
              AllOf(HasSubstr("column 1 has 12,345"), HasSubstr("separators of thousands")));
  EXPECT_THAT(Refusal("b.csv", "x;y;z\n1;12.345;2\n3;-678;4\n"), HasSubstr("column 2"));
  EXPECT_THAT(Refusal("c.txt", "1,000\t7,5\t2,5\n678\t3,5\t4,5\n"), HasSubstr("column 1"));
  // Decimals of three digits, with a whole number among them or not.
  EXPECT_EQ(Read("d.csv", "x;y;z\n12,345;1;2\n0,678;3;4\n5;6;7\n").positions[0].x(), 12.345);
  EXPECT_EQ(Read("e.csv", "x;y;z\n12,345;1;2\n6,789;3;4\n").positions[0].x(), 12.345);
}

TEST_F(PointFiles, DecimalCommasWithoutNamesAreReadOrRefused) {
  const PointTable table = Read("a.txt", "37,5\t44,25\t-1,125\n38,5\t44,5\t1,5\n");
  EXPECT_EQ(table.positions[0], Vec3(37.5, 44.25, -1.125));
  EXPECT_THAT(table.notes.front(), HasSubstr("commas are read as decimal points"));
  EXPECT_EQ(Read("b.csv", "37,5;44,25;-1,125\n").positions[0], Vec3(37.5, 44.25, -1.125));
  EXPECT_THAT(Refusal("c.csv", "37,074,44,25,-1,125\n38,5,44,5,1,5\n"),
              HasSubstr("they look like three numbers with decimal commas"));
  EXPECT_EQ(Read("d.csv", "37,74,44,25,1,125\n").positions[0], Vec3(37, 74, 44));
}

TEST_F(PointFiles, DegreesThatCannotBeRightAreRefused) {
  EXPECT_THAT(Refusal("a.csv", "lat,lon,z\n100,5,1\n160,6,2\n"),
              HasSubstr("latitudes go from 100 to 160, and end at 90 degrees"));
  EXPECT_THAT(Refusal("b.csv", "lon,lat,z\n178,5,1\n179.5,6,2\n-179,5,1\n-178,6,2\n"),
              AllOf(HasSubstr("-179 to -178 and at 178 to 179.5"),
                    HasSubstr("add 360 to the negative longitudes")));
  EXPECT_THAT(Refusal("c.csv", "lon;lat;z\n358;5;1\n359;6;2\n1;5;1\n2;6;2\n"),
              HasSubstr("subtract 360"));
  // All around the Earth, two places, and map coordinates in metres.
  EXPECT_EQ(Read("d.csv", "lon,lat,z\n-179,5,1\n-60,6,2\n60,5,1\n179,6,2\n").positions.size(), 4u);
  EXPECT_EQ(Read("e.csv", "lon,lat,z\n-80,5,1\n-79,6,2\n120,5,1\n").positions.size(), 3u);
  EXPECT_EQ(Read("f.csv", "lon,lat,z\n500000,120,1\n500001,121,2\n").positions.size(), 2u);
}

}  // namespace
}  // namespace semblance::problems
