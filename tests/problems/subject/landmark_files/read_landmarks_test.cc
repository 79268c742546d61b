// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmark_files/read_landmarks.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "problems/subject/sites.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class LandmarkReadingTest : public ::testing::Test {
 protected:
  std::filesystem::path Write(const std::string& name, const std::string& text) {
    WriteFileAtomically(folder_ / name, text);
    return folder_ / name;
  }
  LandmarkReading Read(const std::string& name, const std::string& text,
                       const ReadLandmarksOptions& options = {}) {
    return ReadLandmarks(Write(name, text), options);
  }
  std::string Fault(const std::string& name, const std::string& text,
                    const ReadLandmarksOptions& options = {}) {
    try {
      Read(name, text, options);
    } catch (const Error& error) {
      return error.what();
    }
    return "no fault";
  }

  testing::ScratchFolder folder_;
};

// All sites at uneven points, with all fields of a landmark set.
LandmarkFile SampleFile() {
  LandmarkFile file;
  file.subject = "sample";
  Random random(3);
  for (const Site& site : StandardSites()) {
    const Vec3 p = random.InBox(-100, 100);
    file.landmarks.push_back({.site = site.code,
                              .point = {p.x(), p.y(), p.z()},
                              .normal = std::array{0.0, -0.6, 0.8},
                              .depth_along_normal_mm = random.Uniform(1, 20),
                              .depth_closest_mm = random.Uniform(1, 20),
                              .certainty = Certainty::kLow,
                              .doubt_mm = std::nullopt,
                              .note = "worn, see \"photo\" 3"});
  }
  return file;
}

class EveryKind : public LandmarkReadingTest, public ::testing::WithParamInterface<const char*> {};

// A written file is read back with the same bits, except for the contents that LostContents names.
TEST_P(EveryKind, ReadsWhatItWrites) {
  const LandmarkFile file = SampleFile();
  const std::string name = fmt::format("sample{}", GetParam());
  const LandmarkReading back = Read(name, EncodeLandmarks(file, name));
  ASSERT_EQ(back.file.landmarks.size(), file.landmarks.size());
  const bool keeps_all = LostContents(file, name).empty();
  for (std::size_t k = 0; k < file.landmarks.size(); ++k) {
    const Landmark &a = file.landmarks[k], &b = back.file.landmarks[k];
    EXPECT_EQ(a.site, b.site);
    EXPECT_EQ(a.point, b.point);
    if (keeps_all) {
      EXPECT_EQ(a.normal, b.normal);
      EXPECT_EQ(a.depth_along_normal_mm, b.depth_along_normal_mm);
      EXPECT_EQ(a.depth_closest_mm, b.depth_closest_mm);
      EXPECT_EQ(a.certainty, b.certainty);
      EXPECT_EQ(a.note, b.note);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(, EveryKind,
                         ::testing::Values(".yaml", ".yml", ".mrk.json", ".fcsv", ".pp", ".csv",
                                           ".txt", ".asc"),
                         [](const auto& kind) {
                           std::string name = kind.param;
                           std::erase(name, '.');
                           return name;
                         });

// Only YAML can state RAS. All other formats state LPS, or nothing, which is taken as LPS.
TEST_P(EveryKind, HoldsTheSamePointsWhateverTheAxes) {
  const LandmarkFile lps = SampleFile();
  LandmarkFile ras = lps;
  ras.axes = "RAS";
  for (Landmark& l : ras.landmarks) {
    l.point = {-l.point[0], -l.point[1], l.point[2]};
    l.normal = {-(*l.normal)[0], -(*l.normal)[1], (*l.normal)[2]};
  }
  const std::string name = fmt::format("sample{}", GetParam());
  const LandmarkReading back = Read(name, EncodeLandmarks(ras, name));
  for (std::size_t k = 0; k < lps.landmarks.size(); ++k) {
    EXPECT_EQ(back.file.landmarks.at(k).point, lps.landmarks[k].point);
    if (back.file.landmarks[k].normal) {
      EXPECT_EQ(back.file.landmarks[k].normal, lps.landmarks[k].normal);
    }
  }
  const bool says_ras = WrittenAxes(ras, name) == "RAS";
  EXPECT_EQ(says_ras, name.ends_with(".yaml") || name.ends_with(".yml"));
  EXPECT_EQ(says_ras, LostContents(ras, name) == LostContents(lps, name));
}

TEST_F(LandmarkReadingTest, ListsWhatAFileLoses) {
  LandmarkFile file = SampleFile();
  EXPECT_THAT(LostContents(file, "a.csv"), IsEmpty());
  EXPECT_THAT(LostContents(file, "a.fcsv"),
              ElementsAre("normals, depths and certainties of 32 landmarks"));
  EXPECT_THAT(LostContents(file, "a.pp"),
              ElementsAre(HasSubstr("normals"), "notes of 32 landmarks"));
  file.absent.push_back({"g", "gone"});
  EXPECT_THAT(LostContents(file, "a.csv"), ElementsAre(HasSubstr("1 sites")));
  EXPECT_THAT(LostContents(file, "a.yaml"), IsEmpty());
  file.axes = "RAS";
  EXPECT_THAT(LostContents(file, "a.pp"), ::testing::Contains(HasSubstr("turned to LPS")));
}

TEST_F(LandmarkReadingTest, SlicersAxesAreThoseOfTheFile) {
  const auto markups = [](const char* axes) {
    return fmt::format(
        R"({{"@schema": "x", "markups": [{{"type": "Fiducial", "coordinateSystem": "{}",
            "coordinateUnits": "mm", "controlPoints": [
            {{"id": "1", "label": "nasion", "position": [1.5, 2, 3], "positionStatus": "defined"}},
            {{"id": "2", "label": "left gonion", "position": [0, 0, 0], "positionStatus": "undefined"}}]}}]}})",
        axes);
  };
  const LandmarkReading lps = Read("a.mrk.json", markups("LPS"));
  EXPECT_EQ(lps.file.landmarks.at(0).site, "n");
  EXPECT_EQ(lps.file.landmarks.at(0).point, (std::array{1.5, 2.0, 3.0}));
  EXPECT_EQ(lps.file.absent.at(0).site, "go_l");
  EXPECT_THAT(lps.notes, IsEmpty());
  const LandmarkReading ras = Read("a.mrk.json", markups("RAS"));
  EXPECT_EQ(ras.file.landmarks.at(0).point, (std::array{-1.5, -2.0, 3.0}));
  EXPECT_THAT(ras.notes, ElementsAre(HasSubstr("turned from RAS to LPS")));
  EXPECT_THAT(Fault("a.mrk.json", markups("LAS")), HasSubstr("must be \"LPS\" or \"RAS\""));
  EXPECT_THAT(Fault("a.mrk.json", markups("LPS"), {.axes = Axes::kRas}),
              HasSubstr("the file has LPS axes, and RAS was requested"));
}

// Only Slicer's state "defined" means that a point is placed. Slicer writes "" as the position of a
// point without one, and keeps the former position of a missing point.
TEST_F(LandmarkReadingTest, SlicersPointsThatAreNotPlacedAreAbsent) {
  const auto markups = [](const std::string& point) {
    return fmt::format(
        R"({{"markups": [{{"coordinateSystem": "LPS", "controlPoints": [
            {{"label": "n", "position": [1, 2, 3]}}, {{"label": "g", {}}}]}}]}})",
        point);
  };
  for (const char* status : {"undefined", "missing", "preview"}) {
    for (const char* position : {R"("")", "[4, 5, 6]", "[]"}) {
      const LandmarkFile file =
          Read("a.mrk.json",
               markups(fmt::format(R"("position": {}, "positionStatus": "{}")", position, status)))
              .file;
      ASSERT_EQ(file.landmarks.size(), 1U) << status << position;
      EXPECT_EQ(file.absent.at(0).site, "g");
      EXPECT_NE(file.absent[0].reason, "");
    }
  }
  for (const char* point :
       {R"("position": "")", R"("position": [1, 2])", R"("position": [1, 2, null])",
        R"("position": [1, 2, "3"])", R"("id": "2")"}) {
    EXPECT_THAT(Fault("a.mrk.json", markups(point)),
                ::testing::AllOf(HasSubstr("a.mrk.json: point 2 'g': 'position' is "),
                                 HasSubstr("must be [x, y, z]")));
  }
  EXPECT_THAT(Fault("a.mrk.json", markups(R"("positionStatus": "gone")")),
              HasSubstr("point 2 'g': the position status is 'gone'; it must be defined (2)"));
}

TEST_F(LandmarkReadingTest, RequestedAxesMustAgreeWithYaml) {
  const std::string ras = "axes: RAS\nlandmarks: [{site: g, point: [1, 2, 3]}]\n";
  EXPECT_EQ(Read("a.yaml", ras, {.axes = Axes::kRas}).file.landmarks.at(0).point,
            (std::array{-1.0, -2.0, 3.0}));
  EXPECT_THAT(Fault("a.yaml", ras, {.axes = Axes::kLps}),
              HasSubstr("the file has RAS axes, and LPS was requested"));
  const std::string silent = "landmarks: [{site: g, point: [1, 2, 3]}]\n";
  EXPECT_EQ(Read("a.yaml", silent, {.axes = Axes::kLps}).file.landmarks.at(0).point,
            (std::array{1.0, 2.0, 3.0}));
  EXPECT_THAT(Fault("a.yaml", silent, {.axes = Axes::kRas}),
              HasSubstr("correct `axes` in the file (LPS if it has none)"));
}

TEST_F(LandmarkReadingTest, AFileWithoutMarkupsIsRefused) {
  for (const char* text : {"", "{\"markups\": [", "{}", "[]", "{\"markups\": [3]}",
                           "{\"markups\": [{\"coordinateSystem\": \"LPS\"}]}"}) {
    EXPECT_THAT(Fault("a.mrk.json", text), HasSubstr("a.mrk.json: ")) << text;
  }
}

TEST_F(LandmarkReadingTest, OldFiducialListsOfSlicer) {
  const std::string head = "# Markups fiducial file version = 4.11\n# CoordinateSystem = {}\n";
  const std::string rows =
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
      "1,-2.5,10,3e1,0,0,0,1,1,1,0,glabella,\"a, b\",vtkMRMLScalarVolumeNode1,2,0\r\n";
  for (const char* axes : {"LPS", "1"}) {
    const auto file = Read("a.fcsv", fmt::format(fmt::runtime(head), axes) + rows).file;
    EXPECT_EQ(file.landmarks.at(0).point, (std::array{-2.5, 10.0, 30.0}));
    EXPECT_EQ(file.landmarks.at(0).site, "g");
    EXPECT_EQ(file.landmarks.at(0).note, "a, b");
  }
  for (const char* axes : {"RAS", "0"}) {
    const auto file = Read("a.fcsv", fmt::format(fmt::runtime(head), axes) + rows).file;
    EXPECT_EQ(file.landmarks.at(0).point, (std::array{2.5, -10.0, 30.0}));
  }
  EXPECT_THAT(Fault("a.fcsv", rows), HasSubstr("the line '# CoordinateSystem"));
  EXPECT_THAT(Fault("a.fcsv", "# CoordinateSystem = LPS\n1,x,0,0,0,0,0,1,1,1,0,g,,\n"),
              HasSubstr("a.fcsv:2: 'x' is not a finite decimal number"));
}

TEST_F(LandmarkReadingTest, PointsOfMeshLab) {
  const LandmarkReading reading =
      Read("a.pp",
           "<!DOCTYPE PickedPoints>\n<PickedPoints>\n <DocumentData><User name=\"x\"/>"
           "</DocumentData>\n <point x=\"1\" y=\"2\" z=\"3\" active=\"1\" name=\"3\"/>\n"
           " <point x=\"0\" y=\"0\" z=\"0\" active=\"0\" name=\"g\"/>\n</PickedPoints>\n");
  EXPECT_EQ(reading.file.landmarks.at(0).site, "n");
  EXPECT_EQ(reading.file.absent.at(0).site, "g");
  EXPECT_THAT(reading.notes, ElementsAre(HasSubstr("taken as LPS")));
  EXPECT_THAT(Fault("a.pp", "<Other/>"), HasSubstr("no PickedPoints of MeshLab"));
  EXPECT_THAT(Fault("a.pp",
                    "<PickedPoints><point x=\"1\" y=\"nan\" z=\"0\" name=\"g\"/>"
                    "</PickedPoints>"),
              HasSubstr("a.pp: point 1 'g': attribute y: 'nan' is not a finite decimal number"));
  EXPECT_THAT(Fault("a.pp",
                    "<PickedPoints><point x=\"1\" y=\"2\" z=\"3\" name=\"n\"/>"
                    "<point x=\"1\" y=\"2\" name=\"g\"/></PickedPoints>"),
              HasSubstr("a.pp: point 2 'g': attribute z: missing; place the point again"));
  EXPECT_EQ(Fault("a.pp",
                  "<PickedPoints><point x=\"1\" y=\"2\" z=\"3\" name=\"n\"/>"
                  "<point x=\"nan\" active=\"0\" name=\"g\"/></PickedPoints>"),
            "no fault");
}

TEST_F(LandmarkReadingTest, ListsOfCloudCompare) {
  for (const char* text :
       {"g,1,2,3\nleft gonion,4,5,6\n", "g;1;2;3\ngo_l;4;5;6", "g 1 2 3\ngo_l\t4  5 6\n"}) {
    const LandmarkFile file = Read("a.txt", text).file;
    EXPECT_EQ(file.landmarks.at(1).site, "go_l") << text;
    EXPECT_EQ(file.landmarks.at(1).point, (std::array{4.0, 5.0, 6.0}));
  }
  EXPECT_THAT(Fault("a.asc", "1,2,3\n"), HasSubstr("a.asc:1: the point has no name"));
  EXPECT_THAT(Fault("a.txt", ",1,2,3\n"), HasSubstr("a.txt:1: the point has no name"));
  for (const char* text : {"g,1,2,3\nn,1,,3\n", "g;1;2;3\nn;1; ;3\n", "\n\"n\",1,\"\",3\n"}) {
    EXPECT_THAT(Fault("a.txt", text), HasSubstr("a.txt:2: column 3 (y) is empty")) << text;
  }
  EXPECT_THAT(Fault("a.txt", "n,1,2,\n"), HasSubstr("a.txt:1: column 4 (z) is empty"));
  EXPECT_EQ(Read("a.txt", "n,1,2,3,\n").file.landmarks.at(0).point, (std::array{1.0, 2.0, 3.0}));
}

TEST_F(LandmarkReadingTest, TablesWithCommasOrSemicolons) {
  const LandmarkReading reading = Read(
      "a.csv", "Label;Y;X;Z;Author;depth_along_normal_mm\ng;2,5;1,25;-3;ab;4,5\nn;1;0;0;ab;\n");
  EXPECT_EQ(reading.file.landmarks.at(0).point, (std::array{1.25, 2.5, -3.0}));
  EXPECT_EQ(reading.file.landmarks.at(0).depth_along_normal_mm, 4.5);
  EXPECT_EQ(reading.file.landmarks.at(1).depth_along_normal_mm, std::nullopt);
  EXPECT_THAT(reading.notes,
              ElementsAre(HasSubstr("ignored columns: Author"), HasSubstr("taken as LPS")));
  EXPECT_THAT(Fault("a.csv", "name,x,y\ng,1,2\n"), HasSubstr("there is no column z or z_mm"));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z\ng,1,-2e90,3\n"),
              HasSubstr("a.csv: site g: a coordinate"));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z\ng,1,2,inf\n"), HasSubstr("a.csv:2: column 'z'"));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z\ng,\"1,5\",2,0\n"), HasSubstr("'1,5' is not a finite"));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z,normal_x\ng,1,2,0,1\n"), HasSubstr("normal_z, or none"));
  EXPECT_THAT(Fault("a.csv", "site;x;y;z\ng;1.000,5;2;0\n"), HasSubstr("'1.000,5' is not"));
}

TEST_F(LandmarkReadingTest, ChecksTheValuesOfATableAsThoseOfYaml) {
  const std::string head =
      "site,x,y,z,normal_x,normal_y,normal_z,depth_along_normal_mm,depth_closest_mm\n";
  EXPECT_THAT(Fault("a.csv", head + "nasion,1,2,3,,,,-5,\ng,1,2,3,,,,4,1000\n"),
              ::testing::AllOf(HasSubstr("a.csv: site n (Nasion): depth_along_normal_mm: -5 is out "
                                         "of range; allowed is 0.01 to 100 mm\n"),
                               HasSubstr("a.csv: site g (Glabella): depth_closest_mm: 1000 is")));
  EXPECT_THAT(Fault("a.csv", head + "n,1,2,3,3,0,0,,\n"),
              HasSubstr("a.csv: site n (Nasion): normal: has the length 3; it must be 1"));
  EXPECT_EQ(Fault("a.csv", head + "n,1,2,3,0,0,1,5,\n"), "no fault");
}

TEST_F(LandmarkReadingTest, RefusesBytesThatAreNotUtf8AndNamesTheirLine) {
  EXPECT_THAT(Fault("lat.csv", "site,x,y,z,note\nn,1.5,2,3,caf\xe9\n"),
              HasSubstr("lat.csv:2: a byte that is not UTF-8; save the file as UTF-8"));
  EXPECT_THAT(Fault("lat.txt", "n,1.5,2,3\n\ngonion\xff,1,2,3\n"), HasSubstr("lat.txt:3: a byte"));
  EXPECT_THAT(Fault("lat.fcsv", "# CoordinateSystem = LPS\n1,1,2,3,0,0,0,1,1,1,0,n,\xe9,\n"),
              HasSubstr("lat.fcsv:2: a byte"));
  EXPECT_EQ(Read("utf8.csv", "site,x,y,z,note\nn,1.5,2,3,caf\xc3\xa9\n").file.landmarks.at(0).note,
            "caf\xc3\xa9");
  // XML states its own encoding; here the first line states Latin-1.
  EXPECT_EQ(Fault("lat.pp",
                  "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>\n<PickedPoints><!-- caf\xe9 -->"
                  "<point x=\"1\" y=\"2\" z=\"3\" name=\"n\"/></PickedPoints>"),
            "no fault");
}

TEST_F(LandmarkReadingTest, OnlyCommasInNumbersAreDecimalCommas) {
  const auto file = Read("a.csv", "site;x;y;z;note\nn;1.5;2;3;\"a, b\"\n").file;
  EXPECT_EQ(file.landmarks.at(0).point, (std::array{1.5, 2.0, 3.0}));
  EXPECT_EQ(file.landmarks[0].note, "a, b");
  const auto decimal_commas =
      Read("a.csv", "site;x;y;z;depth_closest_mm;note\nn;1;2;3;4,5;a. b\n").file;
  EXPECT_EQ(decimal_commas.landmarks.at(0).depth_closest_mm, 4.5);
  EXPECT_THAT(Fault("a.csv", "site;x;y;z\nn;1,5;2;3\ng;1.5;2;3\n"), HasSubstr("a.csv:3: column"));
}

TEST_F(LandmarkReadingTest, NamesAllFaultsAtOnce) {
  const std::string table = "site,x,y,z\nF-1,0,0,0\ngonion,0,0,0\ng,0,0,0\nglabella,1,1,1\n";
  EXPECT_THAT(Fault("a.csv", table),
              ::testing::AllOf(HasSubstr("'F-1' is not a site"), HasSubstr("is on both sides"),
                               HasSubstr("site g (Glabella) appears twice")));
  const LandmarkReading reading = Read("a.csv", "site,x,y,z\nF-1,0,0,0\ng,0,0,1\n",
                                       {.axes = Axes::kLps, .leave_out_unknown = true});
  EXPECT_EQ(reading.file.landmarks.size(), 1U);
  EXPECT_THAT(reading.notes, ElementsAre(HasSubstr("left out: 'F-1' is not a site")));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z\n"), HasSubstr("there is no landmark"));
  EXPECT_THAT(Fault("a.stl", ""), HasSubstr("unknown kind of landmark file"));
}

std::vector<std::string> Sites(const LandmarkFile& file) {
  std::vector<std::string> sites;
  std::ranges::transform(file.landmarks, std::back_inserter(sites), &Landmark::site);
  return sites;
}

std::vector<std::string> AbsentSites(const LandmarkFile& file) {
  std::vector<std::string> sites;
  std::ranges::transform(file.absent, std::back_inserter(sites), &AbsentLandmark::site);
  return sites;
}

// Slicer 5.2 and later write the status of a point in a cell that the header does not name.
TEST_F(LandmarkReadingTest, TheStatusOfAFiducialListDecidesWhetherAPointIsPlaced) {
  const std::string head =
      "# CoordinateSystem = LPS\n"
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  const auto row = [](const char* site, const char* end) {
    return fmt::format("1,1,2,3,0,0,0,1,1,1,0,{},{}\n", site, end);
  };
  const auto file = Read("a.fcsv", head + row("sg", ",") + row("g", ",,") + row("n", ",,0,0") +
                                       row("rhi", ",,1,0") + row("pr", ",,2,0") +
                                       row("id", ",,3,0") + row("sm", ",,2"))
                        .file;
  EXPECT_THAT(Sites(file), ElementsAre("sg", "g", "pr", "sm"));
  EXPECT_THAT(AbsentSites(file), ElementsAre("n", "rhi", "id"));
  EXPECT_EQ(file.absent.back().reason, "marked as missing in Slicer");
  EXPECT_THAT(Fault("a.fcsv", head + row("n", ",,7,0")),
              HasSubstr("a.fcsv:3: the position status is '7'; it must be defined (2)"));
  EXPECT_THAT(Fault("a.fcsv", head + row("n", "a, b, c,,2,0")),
              HasSubstr("a.fcsv:3: 18 cells, where the header names 14"));
  EXPECT_THAT(Fault("a.fcsv", head + "# CoordinateSystem = RAS\n" + row("n", ",")),
              HasSubstr("a.fcsv:3: a second coordinate system"));
}

TEST_F(LandmarkReadingTest, AListOfSlicer3TakesTheRequestedAxes) {
  const std::string list = "# Fiducial List file\n# columns = label,x,y,z,sel,vis\nn,1,2,3,1,1\n";
  EXPECT_EQ(Read("a.fcsv", list, {.axes = Axes::kRas}).file.landmarks.at(0).point,
            (std::array{-1.0, -2.0, 3.0}));
  EXPECT_EQ(Read("a.fcsv", list, {.axes = Axes::kLps}).file.landmarks.at(0).point,
            (std::array{1.0, 2.0, 3.0}));
  EXPECT_THAT(Fault("a.fcsv", list), HasSubstr("or convert it with --axes"));
}

TEST_F(LandmarkReadingTest, HiddenPointsCountAndAreNoted) {
  const LandmarkReading list =
      Read("a.fcsv",
           "# CoordinateSystem = LPS\n# columns = label,x,y,z,sel,vis\nn,1,2,3,0,1\ng,4,5,6,1,1\n");
  EXPECT_THAT(list.notes, ElementsAre(HasSubstr("hidden or not selected in Slicer, and read all "
                                                "the same: n; delete points")));
  const LandmarkReading markups = Read("a.mrk.json", R"({"markups": [{"coordinateSystem": "LPS",
      "controlPoints": [{"label": "n", "position": [1, 2, 3], "visibility": false}]}]})");
  EXPECT_THAT(markups.notes, ElementsAre(HasSubstr("the same: n;")));
  EXPECT_THAT(Read("a.csv", "label,l,p,s,selected,visible,locked\nn,1,2,3,1,0,1\n").notes,
              ElementsAre(HasSubstr("the same: n;")));
}

// The points of curves and lines are named after their list, as R-11, which would be a site.
TEST_F(LandmarkReadingTest, OnlyMarkupsOfPointsAreLandmarks) {
  const auto markups = [](const char* type) {
    return fmt::format(R"({{"markups": [{{"type": "{}", "coordinateSystem": "RAS",
        "controlPoints": [{{"label": "R-11", "position": [1, 2, 3]}}]}},
        {{"type": "Fiducial", "coordinateSystem": "LPS",
        "controlPoints": [{{"label": "n", "position": [4, 5, 6]}}]}}]}})",
                       type);
  };
  for (const char* type : {"Line", "Angle", "Curve", "ClosedCurve", "Plane", "ROI"}) {
    const LandmarkReading reading = Read("a.mrk.json", markups(type));
    EXPECT_THAT(Sites(reading.file), ElementsAre("n"));
    EXPECT_THAT(reading.notes,
                ElementsAre(HasSubstr(fmt::format(
                    "left out a markup of type {} with 1 points (R-11); only the points", type))));
  }
  EXPECT_THAT(Fault("a.mrk.json", R"({"markups": [{"type": "Curve", "controlPoints": []}]})"),
              HasSubstr("there is no landmark; place at least one; "));
}

TEST_F(LandmarkReadingTest, ATableStatesItsAxesAndWhichPointsAreDefined) {
  const LandmarkReading lps = Read("a.csv",
                                   "label,l,p,s,defined,selected,visible,locked,description\n"
                                   "g,1,2,3,1,1,1,0,worn\nn,0,0,0,0,1,1,0,\npr,,,,0,1,1,0,\n");
  EXPECT_EQ(lps.file.landmarks.at(0).point, (std::array{1.0, 2.0, 3.0}));
  EXPECT_EQ(lps.file.landmarks[0].note, "worn");
  EXPECT_THAT(AbsentSites(lps.file), ElementsAre("n", "pr"));
  EXPECT_EQ(lps.file.absent[0].reason, "defined is 0 in the table");
  EXPECT_THAT(lps.notes, IsEmpty());
  const LandmarkReading ras = Read("a.csv", "label,R,A,S,missing\ng,1,2,3,\nn,4,5,6,yes\n");
  EXPECT_EQ(ras.file.landmarks.at(0).point, (std::array{-1.0, -2.0, 3.0}));
  EXPECT_THAT(AbsentSites(ras.file), ElementsAre("n"));
  EXPECT_THAT(ras.notes, ElementsAre(HasSubstr("turned from RAS to LPS")));
  EXPECT_THAT(AbsentSites(Read("a.csv", "site,x,y,z,position_status\nn,1,2,3,3\ng,1,2,3,2\n").file),
              ElementsAre("n"));
  EXPECT_THAT(Fault("a.csv", "label,l,p,s\ng,1,2,3\n", {.axes = Axes::kRas}),
              HasSubstr("the file has LPS axes, and RAS was requested"));
  EXPECT_THAT(Fault("a.csv", "label,l,p,s,x,y,z\ng,1,2,3,1,2,3\n"),
              HasSubstr("a.csv:1: the columns hold the coordinates twice"));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z,defined\ng,1,2,3,maybe\n"),
              HasSubstr("a.csv:2: column 'defined': 'maybe' is neither 0 nor 1"));
  EXPECT_THAT(Fault("a.csv", "site,x,y,z,position_status\ng,1,2,3,9\n"),
              HasSubstr("a.csv:2: the position status is '9'"));
}

TEST_F(LandmarkReadingTest, TablesWithTabsAndWithEmptyRows) {
  const auto tabs = Read("a.csv", "site\tx\ty\tz\tnote\nn\t1\t2\t3\t\"a\tb\"\n\t\t\t\t\n").file;
  EXPECT_EQ(tabs.landmarks.at(0).point, (std::array{1.0, 2.0, 3.0}));
  EXPECT_EQ(tabs.landmarks[0].note, "a\tb");
  EXPECT_EQ(Read("a.csv", "site\tx\ty\tz\nn\t1,5\t2\t3\n").file.landmarks.at(0).point,
            (std::array{1.5, 2.0, 3.0}));
  EXPECT_EQ(Sites(Read("a.csv", "site,x,y,z\nn,1,2,3\n,,,\n\n,,,\n").file).size(), 1U);
  EXPECT_THAT(Fault("a.csv", "site,x,y,z\nn,1,2,3\n,,,\ng,1,,3\n"),
              HasSubstr("a.csv:4: column 'y': ''"));
}

TEST_F(LandmarkReadingTest, PointsAtTheOriginWereNeverPlaced) {
  EXPECT_THAT(Fault("a.csv", "site,x,y,z\nn,0,0,0\ng,0,0,0\nsg,1,2,3\n"),
              HasSubstr("sites n, g are at the same point 0, 0, 0, so they were never placed"));
  EXPECT_THAT(
      Fault("a.yaml", "landmarks: [{site: g, point: [0, 0, 0]}, {site: n, point: [0, 0, 0.0]}]\n"),
      HasSubstr("sites g, n are at the same point"));
  EXPECT_THAT(Read("a.yaml", "landmarks: [{site: g, point: [0, 0, 0]}]\n").notes,
              ElementsAre("a.yaml: site g is at 0, 0, 0; check that it was placed"));
}

TEST_F(LandmarkReadingTest, APointOnTheSkinIsNotTakenForTheBone) {
  for (const char* name : {"n'", "n\u2019", "n\u2032", "soft tissue nasion", "n (skin)"}) {
    EXPECT_THAT(Fault("a.csv", fmt::format("site,x,y,z\n{},1,2,3\n", name)),
                HasSubstr("names a point on the skin"))
        << name;
  }
  const LandmarkReading reading = Read("a.csv", "site,x,y,z\nn',1,2,3\ng,1,2,3\n",
                                       {.axes = Axes::kLps, .leave_out_unknown = true});
  EXPECT_THAT(Sites(reading.file), ElementsAre("g"));
  EXPECT_THAT(reading.notes, ElementsAre(HasSubstr("left out: 'n'' names a point on the skin")));
}

// The inputs that failed in the field, each with its right points.
class FieldLandmarks : public LandmarkReadingTest {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kField)) {
      GTEST_SKIP() << "the inputs of the field are not here";
    }
  }
  // Checks the sites with their points, and those that are listed as absent.
  void ExpectSites(const LandmarkReading& reading, const std::vector<std::string>& sites,
                   const std::vector<std::string>& absent) {
    const std::map<std::string, std::array<double, 3>> points = {
        {"sg", {132.2, 36.4, 150.7}},  {"g", {131.8, 32.7, 140.3}}, {"n", {131.2, 36.6, 129.4}},
        {"rhi", {131.2, 24.6, 114.2}}, {"mp", {128.1, 41.2, 63.5}}, {"pr", {127.8, 40, 58}}};
    EXPECT_EQ(Sites(reading.file), sites);
    EXPECT_EQ(AbsentSites(reading.file), absent);
    for (const Landmark& landmark : reading.file.landmarks) {
      EXPECT_EQ(landmark.point, points.at(landmark.site)) << landmark.site;
    }
  }
  const std::filesystem::path kField = SEMBLANCE_SOURCE_DIR "/../shared/data/field";
  const std::vector<std::string> kAll = {"sg", "g", "n", "rhi", "mp", "pr"};
  const std::vector<std::string> kWithoutMp = {"sg", "g", "n", "rhi", "pr"};
};

TEST_F(FieldLandmarks, HaveTheirRightPoints) {
  ExpectSites(ReadLandmarks(kField / "status.fcsv"), {"sg", "g", "rhi", "pr"}, {"n", "mp"});
  ExpectSites(ReadLandmarks(kField / "defined-column.csv"), kWithoutMp, {"mp"});
  ExpectSites(ReadLandmarks(kField / "slicer-table.csv"), kWithoutMp, {"mp"});
  ExpectSites(ReadLandmarks(kField / "slicer3.fcsv", {.axes = Axes::kRas}), kAll, {});
  ExpectSites(ReadLandmarks(kField / "line-beside.mrk.json"), kAll, {});
  ExpectSites(ReadLandmarks(kField / "tabs.csv"), kAll, {});
  ExpectSites(ReadLandmarks(kField / "empty-rows.csv"), kAll, {});
  EXPECT_THAT(Sites(ReadLandmarks(kField / "standard-names.csv").file),
              ElementsAre("g", "n", "go_r", "go_l", "zy_r", "zy_l", "mso_r", "mso_l", "sM2_r"));
  EXPECT_THAT(ReadLandmarks(kField / "standard-names.csv").notes,
              ::testing::Contains(HasSubstr("'ecm2R' is taken for sM2_r")));
}

}  // namespace
}  // namespace semblance::problems
