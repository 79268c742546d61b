// SPDX-License-Identifier: GPL-3.0-or-later
// NRRD and its spaces.
#include "problems/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which else brings a part of an older one

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/testing/volume_files.h"

namespace semblance {
namespace {

using ::testing::AllOf;
using testing::BytesOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::LpsDirections;
using ::testing::Not;
using ReadNrrdTest = testing::VolumeFilesTest;

TEST_F(ReadNrrdTest, EverySpaceOfAnNrrdIsTurnedToLps) {
  const Vec3 lps(1, 1, 1), ras(-1, -1, 1), las(1, -1, 1);
  for (const auto& [space, to_space] :
       {std::pair("left-posterior-superior", lps), std::pair("LPS", lps),
        std::pair("right-anterior-superior", ras), std::pair("ras", ras),
        std::pair("Left-Anterior-Superior", las), std::pair("LAS", las)}) {
    WriteNrrd("a.nrrd",
              fmt::format("# space: LPS\nspace: {}\n{}", space, LpsDirections(array_, to_space)));
    const VolumeReading reading = Read("a.nrrd");
    ExpectTheHead(reading);
    EXPECT_THAT(reading.notes, Not(Contains(HasSubstr("taken as"))));
  }
  WriteFileAtomically(
      folder_ / "time.nrrd",
      fmt::format(
          "NRRD0004\ntype: short\ndimension: 4\nsizes: {} 1\nspace: LAST\n{}endian: "
          "little\nencoding: raw\n\n{}",
          fmt::join(array_.counts, " "),
          [&] {
            std::string lines = LpsDirections(array_, las, ",0");
            return lines.replace(lines.find("\n"), 1, "(0,0,0,1)\n");
          }(),
          BytesOf(array_.values)));
  ExpectTheHead(Read("time.nrrd"));
}

TEST_F(ReadNrrdTest, SpacesThatSayNothingOfTheHeadAreTold) {
  const std::string directions = LpsDirections(array_, Vec3::Ones());
  for (const auto& [space, why] : {std::pair("space: scanner-xyz\n", "its space is scanner-xyz"),
                                   std::pair("space: 3D-right-handed\n", "is 3D-right-handed"),
                                   std::pair("space dimension: 3\n", "has no 'space'")}) {
    WriteNrrd("a.nrrd", space + directions);
    const VolumeReading reading = Read("a.nrrd");
    ExpectTheHead(reading);
    EXPECT_THAT(reading.notes, Contains(AllOf(HasSubstr("does not say how it lies"), HasSubstr(why),
                                              HasSubstr("taken as LPS"))));
  }
  WriteNrrd("a.nrrd", "space: 3D-left-handed\n" + directions);
  EXPECT_THAT(Words("a.nrrd"), AllOf(HasSubstr("mirror image"), HasSubstr("(LAS)")));
  for (const char* none : {"RPS", "LPI", "3DRH"}) {
    WriteNrrd("a.nrrd", fmt::format("space: {}\n{}", none, directions));
    EXPECT_THAT(Words("a.nrrd"), HasSubstr(fmt::format("'{}' is not a space of NRRD", none)));
  }
  WriteNrrd("a.nrrd", "space: LPS\nspace directions: (1,0) (0,1) (1,1)\n");
  EXPECT_THAT(Words("a.nrrd"), HasSubstr("no vectors of three numbers"));
}

}  // namespace
}  // namespace semblance
