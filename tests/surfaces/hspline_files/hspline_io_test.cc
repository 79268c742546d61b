// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/hspline_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline_files/hspline_json.h"
#include "tests/testing/splines.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using testing::RandomSurface;

class HSplineIo : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  const fs::path folder_ =
      fs::temp_directory_path() / ("semblance_hspline_io_" + std::to_string(::getpid()) + "_" +
                                   ::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(HSplineIo, AFileGivesTheSurfaceBackToTheBit) {
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

TEST_F(HSplineIo, ErrorsNameTheFile) {
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
  EXPECT_THAT(message(), HasSubstr("broken.json: not an H-spline that can be read"));
  EXPECT_THROW(WriteHSpline(folder_ / "absent" / "x.json",
                            RandomSurface({.patches_u = 4, .patches_v = 4, .max_level = 1}, 1)),
               IoError);
}

}  // namespace
}  // namespace semblance
