// SPDX-License-Identifier: GPL-3.0-or-later
// Tests of folders of DICOM slices.
#include "problems/io/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which otherwise includes parts of an older one

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkNiftiImageIO.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "problems/io/volumes/import_ct.h"
#include "tests/testing/volume_files.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::ArrayOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::Resampled;
using testing::SagittalArrayOf;
using testing::WriteDicom;
using testing::WriteItk;
using ReadDicomTest = testing::VolumeFilesTest;

TEST_F(ReadDicomTest, SlicesAreSortedInSpaceAndDecompressed) {
  for (const char* compression : {"", "JPEG", "JPEG2000"}) {
    const std::string name = fmt::format("ct{}", compression);
    WriteDicom(folder_ / name, array_, {.compression = compression});
    WriteFileAtomically(folder_ / name / "notes.txt", "not DICOM");
    const VolumeReading reading = Read(name);
    ExpectTheHead(reading);
    EXPECT_EQ(reading.modality, Modality::kCt);
  }
  ExpectTheSkull(Read("ct").volume);
}

TEST_F(ReadDicomTest, SagittalSlicesInSubfoldersAreRead) {
  WriteDicom(folder_ / "disc/PA0/SE0", SagittalArrayOf(head_.volume));
  ExpectTheHead(Read("disc"));
}

TEST_F(ReadDicomTest, SlopeAndInterceptMakeHounsfieldUnits) {
  WriteDicom(folder_ / "ct", array_, {.slope = 2, .intercept = -1024});
  const CtVolume read = Read("ct").volume;
  ASSERT_EQ(read.values.size(), head_.volume.values.size());
  for (std::size_t n = 0; n < read.values.size(); ++n) {
    ASSERT_LE(std::abs(read.values[n] - head_.volume.values[n]), 2) << n;
  }
}

// The head is turned in the scanner, so the slices' axes are not those of the head.
TEST_F(ReadDicomTest, DirectionCosinesPlaceTheSkull) {
  CtVolume grid = head_.volume;
  const Mat3 turn = Eigen::AngleAxisd(0.2, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const Vec3 middle = head_.volume.World(grid.columns / 2, grid.rows / 2, grid.slices / 2);
  grid.axes = turn;
  grid.origin = middle + turn * (head_.volume.origin - middle);
  WriteDicom(folder_ / "ct", ArrayOf(Resampled(head_.volume, grid)));
  WriteItk(folder_ / "a.nii", ArrayOf(Resampled(head_.volume, grid)), *itk::NiftiImageIO::New());
  for (const char* name : {"ct", "a.nii"}) {
    const CtVolume read = Read(name).volume;
    EXPECT_LT((read.axes - turn).norm(), 1e-4);
    ExpectTheSkull(read);
  }
}

TEST_F(ReadDicomTest, ATiltedGantryPlacesTheSkull) {
  CtVolume grid = head_.volume;
  grid.axes.col(2) = Vec3(0, std::sin(0.3), std::cos(0.3));
  grid.origin.y() -= 0.5 * std::tan(0.3) * grid.slices * grid.spacing_mm.z();
  grid.spacing_mm.z() /= std::cos(0.3);
  WriteDicom(folder_ / "ct", ArrayOf(Resampled(head_.volume, grid)));
  const VolumeReading reading = Read("ct");
  EXPECT_LT((reading.volume.axes - grid.axes).norm(), 1e-4);
  EXPECT_THAT(reading.notes, Contains(HasSubstr("tilted by 17.2 deg")));
  ExpectTheSkull(reading.volume);
}

TEST_F(ReadDicomTest, MissingAndDoubledSlicesAreErrorsUnlessFilled) {
  WriteDicom(folder_ / "ct", array_);
  const fs::path tenth = folder_ / "ct" / fmt::format("IM{:03}", (10 * 37 + 11) % 101);
  fs::copy(tenth, folder_ / "ct" / "copy");
  EXPECT_THAT(Words("ct"), AllOf(HasSubstr("series 1: 1 doubled slices"), HasSubstr("and copy")));
  fs::remove(folder_ / "ct" / "copy");
  fs::remove(tenth);
  EXPECT_THAT(Words("ct"), HasSubstr("series 1: 1 missing slices, between"));
  const VolumeReading filled = Read("ct", {.series = "", .fill_slices = true});
  EXPECT_THAT(filled.notes, Contains(HasSubstr("interpolated")));
  ASSERT_EQ(filled.volume.slices, head_.volume.slices);
  ExpectTheSkull(filled.volume);
}

TEST_F(ReadDicomTest, OneOfSeveralSeriesIsChosen) {
  VoxelArray scout = array_;
  scout.counts[2] = 2;
  WriteDicom(folder_ / "ct/a", array_, {.series = "1.2.3.1", .number = "2"});
  WriteDicom(folder_ / "ct/b", scout, {.series = "1.2.3.9", .number = "1", .description = "scout"});
  const VolumeReading alone = Read("ct");  // the scout cannot be a head
  ExpectTheHead(alone);
  EXPECT_THAT(alone.notes, Contains(HasSubstr("series left out: 1: CT, 2 slices")));
  for (std::int16_t& value : array_.values) {
    value = static_cast<std::int16_t>(value + 7);
  }
  WriteDicom(folder_ / "ct/c", array_, {.series = "1.2.3.2", .number = "3"});
  EXPECT_THAT(Words("ct"), AllOf(HasSubstr("2 series; choose one"), HasSubstr("\n  2: CT"),
                                 HasSubstr("\n  3: CT"), HasSubstr("UID 1.2.3.2")));
  ExpectTheHead(Read("ct", {.series = "2"}));
  ExpectTheHead(Read("ct", {.series = "1.2.3.1"}));
  EXPECT_EQ(Read("ct", {.series = "3"}).volume.values, array_.values);
  EXPECT_THAT(Words("ct", {.series = "4"}), HasSubstr("no series is called '4'; the series are:"));
}

TEST_F(ReadDicomTest, TheSkinOfAnMrIsExtracted) {
  VoxelArray mr = array_;
  for (std::int16_t& value : mr.values) {  // dark bone, bright tissue, some noise in the air
    value = static_cast<std::int16_t>(value > 400 ? 30 : 20 + std::max(0, (value + 1000) / 3));
  }
  WriteDicom(folder_ / "mr", mr, {.modality = "MR"});
  const VolumeReading reading = Read("mr");
  EXPECT_EQ(reading.modality, Modality::kMr);
  const MrSkin import = ImportMrSkin(reading.volume, {}, {});
  EXPECT_GT(import.skin_value, 60);
  EXPECT_LT(import.skin_value, 330);
  const MeshQuery query(head_.phantom.face);
  for (const Vec3& p : import.skin.points) {
    ASSERT_LT(query.Closest(p).distance_mm, 0.5 * reading.volume.spacing_mm.norm());
  }
  EXPECT_THAT(import.notes, Contains(HasSubstr("no skull")));
}

// GDCM ends its process at some of these, or allocates 4 GB.
TEST_F(ReadDicomTest, ADamagedSliceIsAClearError) {
  constexpr std::size_t kMark = 132;  // bytes up to the end of "DICM"
  const DicomSeriesNames names{.patient = "P", .description = "d", .number = 4};
  const std::string good = EncodeDicomSlice(head_.volume, 0, names);
  std::string flipped = good;
  flipped[kMark + 1] = '\x12';
  for (const std::string& bad : {good.substr(0, kMark + 3), good.substr(0, 600), flipped,
                                 good.substr(0, 538) + good.substr(1022),
                                 good.substr(0, kMark) + std::string(500, '\xff')}) {
    fs::create_directories(folder_ / "ct");
    WriteFileAtomically(folder_ / "ct/one.dcm", bad, Durability::kUnsynced);
    EXPECT_THAT(Words("ct"), HasSubstr("ct"));
  }
}

TEST_F(ReadDicomTest, EncodedSlicesAreReadBack) {
  fs::create_directories(folder_ / "ct");
  const DicomSeriesNames names{.patient = "P", .description = "d", .number = 4};
  for (int k = 0; k < head_.volume.slices; ++k) {
    const std::string bytes = EncodeDicomSlice(head_.volume, k, names);
    EXPECT_EQ(bytes, EncodeDicomSlice(head_.volume, k, names));
    WriteFileAtomically(folder_ / "ct" / fmt::format("{}.dcm", k), bytes, Durability::kUnsynced);
  }
  ExpectTheHead(Read("ct"));
}

}  // namespace
}  // namespace semblance::problems
