// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/hspline_json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <string>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/splines.h"

namespace semblance::surfaces {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::RandomSurface;
using testing::ScratchFolder;

const HSplineShape kWrittenShape{
    .patches_u = 4, .patches_v = 5, .max_level = 2, .closure = Closure::kPeriodicU};

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(HSplineJson, RoundTripsToTheBit) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    HSplineShape shape = kWrittenShape;
    shape.closure = closure;
    const HSplineSurface surface = RandomSurface(shape, 3);
    const std::string text = HSplineToJson(surface);
    const HSplineSurface read = HSplineFromJson(text, "a.json");
    EXPECT_EQ(read.shape(), surface.shape());
    EXPECT_EQ(read.Offsets(), surface.Offsets());
    for (int level = 0; level <= shape.max_level; ++level) {
      EXPECT_EQ(read.Net(level).vertices, surface.Net(level).vertices);
    }
    EXPECT_EQ(HSplineToJson(read), text);
  }
}

TEST(HSplineJson, RefusesEveryOtherText) {
  const std::string good = HSplineToJson(RandomSurface(kWrittenShape, 3, 1));
  const std::vector<std::pair<std::string, std::string>> faults = {
      {good.substr(0, good.size() / 2), "parse error"},
      {Replaced(good, "\"version\":1", "\"version\":2"),
       "only semblance-hspline version 1 in mm can be read"},
      {Replaced(good, "\"units\":\"mm\"", "\"units\":\"m\""), "in mm can be read"},
      {Replaced(good, "\"closure\"", "\"colour\""), "unknown entry 'colour'"},
      {Replaced(good, "\"periodic_u\"", "\"closed\""), "'closed' is not one of open, periodic_u"},
      {Replaced(good, "\"periodic_u\"", "\"periodic_uv\""),
       "'periodic_uv' is not one of open, periodic_u"},
      {Replaced(good, "\"max_level\":2", "\"max_level\":9"),
       "the finest level is 9; it must be in 0..8"},
      {Replaced(good, "\"patches\":[4,5]", "\"patches\":[4,6]"), "does not fit level 0"},
      {Replaced(good, "\"level0\":[[", "\"level0\":[[1e999,"), "number overflow"},
      {Replaced(good, "\"level0\":[[", "\"level0\":[[0,0],["), "is not a list of 3 numbers"},
      {Replaced(good, "\"patches\":[4,", "\"patches\":[4.5,"), "4.5 is not a whole number"},
      {Replaced(good, "\"patches\":[4,", "\"patches\":[4294967300,"), "is not a whole number"},
      {Replaced(good, "\"patches\":[4,", "\"patches\":[true,"), "true is not a whole number"},
      {Replaced(good, "\"patches\":[4,", "\"patches\":[-4,"), "patches are not allowed"},
      {Replaced(good, "\"level0\":[[", "\"level0\":[[\"1\",0,0],["), "\"1\" is not a number"},
      {Replaced(good, "\"level0\":[[", "\"level0\":[[null,0,0],["), "null is not a number"},
      {Replaced(good, "\"level0\":[[", "\"level0\":[[0,0,0],["), "does not fit level 0"},
      {Replaced(good, "\"version\":1", "\"version\":1,\"version\":1"), "'version' appears twice"},
      {Replaced(good, "\"offsets\":[[", "\"offsets\":[[1,2,2,0,0,0],[1,2,2,0,0,0],["),
       "has two offsets"},
      {Replaced(good, "\"offsets\":[", "\"offsets\":[3,"), "3 is not a list of 6 numbers"},
      {Replaced(good, "\"offsets\":[[1,", "\"offsets\":[[7,"), "there is no vertex"},
  };
  for (const auto& [text, words] : faults) {
    try {
      HSplineFromJson(text, "a.json");
      ADD_FAILURE() << "accepted; expected: " << words;
    } catch (const IoError& e) {
      EXPECT_THAT(e.what(), ::testing::StartsWith("a.json: not a readable H-spline: "));
      EXPECT_THAT(e.what(), ::testing::HasSubstr(words));
    }
  }
}

TEST(HSplineJson, ExplainsWhatAnHSplineIsIfTheTextIsNoObject) {
  for (const char* text : {"", " \n", "[1]", "ply\nformat ascii 1.0\n"}) {
    EXPECT_THAT(testing::WordsOf<IoError>([&] { HSplineFromJson(text, "a.json"); }),
                ::testing::AllOf(::testing::StartsWith("a.json: not an H-spline: "),
                                 ::testing::HasSubstr("face.hspline.json of a run")));
  }
}

class HSplineFile : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  const fs::path folder_ =
      fs::temp_directory_path() / ("semblance_hspline_json_" + std::to_string(::getpid()) + "_" +
                                   ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(HSplineFile, AFileGivesTheSurfaceBackToTheBit) {
  const fs::path path = folder_ / "face.hspline.json";
  HSplineSurface surface = RandomSurface({.patches_u = 4, .patches_v = 5, .max_level = 3}, 1);
  ControlNet net = surface.Net(0);
  net.At(0, 0) = Vec3(-0.0, std::numeric_limits<double>::denorm_min(), 1.0 / 3);
  net.At(1, 0) = Vec3(1 + std::numeric_limits<double>::epsilon(), 1e-300, 123456789.123456789);
  surface.SetNet(0, net);
  WriteHSpline(path, surface);
  WriteHSpline(path, surface);  // over the old one
  const HSplineSurface read = ReadHSpline(path);
  EXPECT_EQ(read.shape(), surface.shape());
  EXPECT_EQ(read.Offsets(), surface.Offsets());
  EXPECT_EQ(read.Net(3).vertices, surface.Net(3).vertices);
  EXPECT_TRUE(std::signbit(read.Net(0).At(0, 0).x()));
  EXPECT_EQ(HSplineToJson(read), HSplineToJson(surface));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(HSplineFile, ErrorsNameTheFile) {
  const fs::path path = folder_ / "broken.json";
  const auto message = [&] {
    try {
      ReadHSpline(path);
    } catch (const IoError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(message(), HasSubstr("broken.json: no such file"));
  WriteFileAtomically(path, "{\"format\": \"semblance-hspline\"");
  EXPECT_THAT(message(), HasSubstr("broken.json: not a readable H-spline"));
  EXPECT_THROW(WriteHSpline(folder_ / "absent" / "x.json",
                            RandomSurface({.patches_u = 4, .patches_v = 4, .max_level = 1}, 1)),
               IoError);
}

TEST(FeatureJson, ALibraryKeepsEveryBit) {
  const ScratchFolder folder;
  const HSplineShape shape{.patches_u = 4, .patches_v = 5, .max_level = 3};
  const Feature nose = ExtractFeature(RandomSurface(shape, 7), "nose");
  const Feature ear = ExtractFeature(RandomSurface(shape, 8), "ear_l");
  StoreFeature(folder / "library", nose);
  StoreFeature(folder / "library", ear);
  EXPECT_EQ(ReadFeatureLibrary(folder / "library"),
            (std::map<std::string, Feature>{{"ear_l", ear}, {"nose", nose}}));
}

TEST(FeatureJson, FilesThatAreNotFeaturesAreNamedWithTheirFault) {
  const ScratchFolder folder;
  const std::string good = FeatureToJson(
      ExtractFeature(RandomSurface({.patches_u = 4, .patches_v = 4, .max_level = 1}, 1), "nose"));
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      FeatureFromJson(text, "nose.json");
    } catch (const IoError& e) {
      return e.what();
    }
    return "accepted";
  };
  const auto with = [&](const std::string& old, const std::string& text) {
    std::string copy = good;
    return copy.replace(copy.find(old), old.size(), text);
  };
  EXPECT_EQ(complaint(good), "accepted");
  EXPECT_THAT(complaint("{"), HasSubstr("nose.json"));
  EXPECT_THAT(complaint(with("\"version\":1", "\"version\":2")), HasSubstr("version 2"));
  EXPECT_THAT(complaint(with("\"units\"", "\"unit\"")), HasSubstr("unknown entry 'unit'"));
  EXPECT_THAT(complaint(with("\"offsets\":[[1,", "\"offsets\":[[7,")), HasSubstr("on level 7"));
  EXPECT_THAT(complaint(with("\"nose\"", "\"a/b\"")), HasSubstr("not a name"));
  WriteFileAtomically(folder / "ear.json", good);
  EXPECT_THROW(ReadFeatureLibrary(folder.Path()), IoError);
  EXPECT_THROW(ReadFeatureLibrary(folder / "missing"), IoError);
}

}  // namespace
}  // namespace semblance::surfaces
