// SPDX-License-Identifier: GPL-3.0-or-later
// What all kinds of volumes' files have in common, and MetaImages.
#include "problems/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which else brings a part of an older one

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <array>
#include <string>

#include "tests/testing/volume_files.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using testing::Gzipped;
using ::testing::HasSubstr;
using testing::LpsDirections;
using ::testing::Not;
using testing::PutAt;
using testing::SagittalArrayOf;
using testing::WordsOf;
using testing::WriteItk;
using ReadVolumeTest = testing::VolumeFilesTest;

TEST_F(ReadVolumeTest, NiftiNrrdAndMetaImageAreReadWithTheirPlaces) {
  const VoxelArray sagittal = SagittalArrayOf(head_.volume);
  for (const VoxelArray* array : std::array<const VoxelArray*, 2>{&array_, &sagittal}) {
    for (const char* name : {"a.nii", "a.nii.gz"}) {
      WriteItk(folder_ / name, *array, *itk::NiftiImageIO::New());
      ExpectTheHead(Read(name));
    }
    for (const char* name : {"a.nrrd", "a.nhdr"}) {
      WriteItk(folder_ / name, *array, *itk::NrrdImageIO::New());
      ExpectTheHead(Read(name));
    }
    for (const char* name : {"a.mha", "a.mhd"}) {
      WriteItk(folder_ / name, *array, *itk::MetaImageIO::New());
      ExpectTheHead(Read(name));
    }
  }
  ExpectTheSkull(Read("a.nii.gz").volume);
}

TEST_F(ReadVolumeTest, BigEndianFilesAreRead) {
  std::string swapped;
  for (const std::int16_t value : array_.values) {
    const auto bits = static_cast<std::uint16_t>(value);
    swapped.push_back(static_cast<char>(bits >> 8));
    swapped.push_back(static_cast<char>(bits & 255));
  }
  const Vec3& o = array_.origin;
  const std::string sizes = fmt::format("{}", fmt::join(array_.counts, " "));
  WriteFileAtomically(
      folder_ / "big.mha",
      fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
                  "True\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = {} {} {}\nElementSpacing = "
                  "2.5 2.5 3.5\nDimSize = {}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n{}",
                  o.x(), o.y(), o.z(), sizes, swapped));
  ExpectTheHead(Read("big.mha"));
  // In RAS: x and y negated.
  WriteFileAtomically(
      folder_ / "big.nrrd",
      fmt::format("NRRD0004\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: "
                  "{}\nspace directions: (-2.5,0,0) (0,-2.5,0) (0,0,3.5)\nkinds: domain domain "
                  "domain\nendian: big\nencoding: raw\nspace origin: ({},{},{})\n\n{}",
                  sizes, -o.x(), -o.y(), o.z(), swapped));
  ExpectTheHead(Read("big.nrrd"));
}

TEST_F(ReadVolumeTest, AFileThatDoesNotSayHowItLiesIsTold) {
  constexpr std::size_t kQformCode = 252, kSformCode = 254;
  std::string nifti = NiftiBytes();
  PutAt<std::int16_t>(kQformCode, 0, nifti);
  PutAt<std::int16_t>(kSformCode, 0, nifti);
  WriteFileAtomically(folder_ / "a.nii", nifti);
  WriteFileAtomically(folder_ / "a.nii.gz", Gzipped(nifti));
  WriteNrrd("a.nrrd", "spacings: 2.5 2.5 3.5\n");
  WriteMetaImage("a.mha", "ElementSpacing = 2.5 2.5 3.5\n");
  for (const char* name : {"a.nii", "a.nii.gz", "a.nrrd", "a.mha"}) {
    const VolumeReading reading = Read(name);
    EXPECT_THAT(reading.notes, Contains(AllOf(HasSubstr("the file does not say how it lies ("),
                                              HasSubstr("); taken as LPS"))))
        << name;
    EXPECT_EQ(reading.volume.values, array_.values) << name;
    EXPECT_EQ(reading.volume.origin, Vec3(0, 0, 0)) << name;
    EXPECT_LT((reading.volume.spacing_mm - Vec3(2.5, 2.5, 3.5)).norm(), 1e-6) << name;
  }
  WriteNrrd("a.nrrd", "");
  EXPECT_THAT(Read("a.nrrd").notes, Contains(HasSubstr("taken as LPS, its voxels 1 mm apart")));
  WriteFileAtomically(folder_ / "a.nii", NiftiBytes());
  EXPECT_THAT(Read("a.nii").notes, Not(Contains(HasSubstr("taken as"))));
}

TEST_F(ReadVolumeTest, TheUnitThatAHeaderNamesIsTaken) {
  VoxelArray cm = array_;
  cm.steps /= 10;
  cm.origin /= 10;
  const std::string lines = "space: LPS\n" + LpsDirections(cm, Vec3::Ones());
  WriteNrrd("a.nrrd", lines + "space units: \"cm\" \"cm\" \"cm\"\n");
  WriteMetaImage("a.mha", fmt::format("TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = {} {} {}\n"
                                      "ElementSpacing = .25 .25 .35\nDistanceUnits = cm\n",
                                      cm.origin.x(), cm.origin.y(), cm.origin.z()));
  for (const char* name : {"a.nrrd", "a.mha"}) {
    const VolumeReading reading = Read(name);
    ExpectTheHead(reading);
    EXPECT_THAT(reading.notes, Contains(HasSubstr("lengths are in cm; multiplied by 10 to mm")));
  }
  WriteNrrd("a.nrrd", lines + "space units: \"el\" \"el\" \"el\"\n");
  EXPECT_THAT(Read("a.nrrd").notes, Contains(HasSubstr("in 'el', which is not known here")));
  WriteNrrd("a.nrrd", "spacings: .25 .25 .35\nunits: \"cm\" \"cm\" \"cm\"\n");
  EXPECT_LT((Read("a.nrrd").volume.spacing_mm - Vec3(2.5, 2.5, 3.5)).norm(), 1e-6);
}

TEST_F(ReadVolumeTest, FloatsAreRoundedAndWhatCannotBeIsTold) {
  WriteItk<float>(folder_ / "a.mha", array_, *itk::MetaImageIO::New());
  ExpectTheHead(Read("a.mha"));
  VoxelArray flat = array_;
  for (std::int16_t& value : flat.values) {
    value = value > 0 ? 1 : 0;
  }
  WriteItk(folder_ / "flat.nrrd", flat, *itk::NrrdImageIO::New());
  EXPECT_THAT(Words("flat.nrrd"), HasSubstr("run from 0 to 1 only"));
}

TEST_F(ReadVolumeTest, WhatIsNoVolumeIsOneClearError) {
  fs::create_directories(folder_ / "empty");
  WriteFileAtomically(folder_ / "empty/readme", "nothing here");
  WriteFileAtomically(folder_ / "text.nii", "dear reader");
  WriteFileAtomically(folder_ / "text.nrrd", "dear reader");
  WriteFileAtomically(folder_ / "text.mha", "dear reader");
  WriteFileAtomically(folder_ / "picture.png", "x");
  EXPECT_THAT(Words("none"), HasSubstr("no such file or folder"));
  EXPECT_THAT(Words("empty"), HasSubstr("none of the 1 files in the folder is DICOM"));
  EXPECT_THAT(Words("text.nii"), HasSubstr("it is no NIfTI file"));
  EXPECT_THAT(Words("text.nrrd"), HasSubstr("it is no NRRD file"));
  EXPECT_THAT(Words("text.mha"), HasSubstr("it is no MetaImage file"));
  EXPECT_THAT(Words("picture.png"), HasSubstr("not a kind of volume"));
  EXPECT_THAT(Words("text.nii", {.series = "1"}), HasSubstr("are for folders of DICOM"));
}

// Headers that claim what no file holds: refused before memory is taken for it.
TEST_F(ReadVolumeTest, ClaimsBeyondTheFileAreRefusedAtOnce) {
  const auto mha = [&](const char* spacing, const char* sizes, const char* compressed) {
    WriteFileAtomically(
        folder_ / "x.mha",
        fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
                    "False\nCompressedData = {}\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 "
                    "0\nElementSpacing = {}\nDimSize = {}\nElementType = "
                    "MET_SHORT\nElementDataFile = LOCAL\nabcdefgh",
                    compressed, spacing, sizes));
    return WordsOf<Error>([&] { Read("x.mha"); });
  };
  const auto nrrd = [&](const char* sizes, const char* encoding) {
    WriteFileAtomically(
        folder_ / "x.nrrd",
        fmt::format("NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: "
                    "{}\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nkinds: domain domain "
                    "domain\nendian: little\nencoding: {}\nspace origin: (0,0,0)\n\nabcdefgh",
                    sizes, encoding));
    return WordsOf<Error>([&] { Read("x.nrrd"); });
  };
  for (const char* compressed : {"False", "True"}) {
    EXPECT_THAT(mha("1 1 1", "1500 1500 1500", compressed), HasSubstr("cannot hold"));
    EXPECT_THAT(mha("1 1 1", "2000000000 2000000000 2000000000", compressed),
                HasSubstr("at most 8 GB are read"));
    EXPECT_THAT(mha("-1 1 1", "20 20 20", compressed), HasSubstr("x.mha: "));
    EXPECT_THAT(mha("1 1 1", "-20 20 20", compressed), HasSubstr("x.mha: "));
  }
  for (const char* encoding : {"raw", "gzip"}) {
    EXPECT_THAT(nrrd("1500 1500 1500", encoding), HasSubstr("cannot hold"));
    EXPECT_THAT(nrrd("200000 200000 2000", encoding), HasSubstr("at most 8 GB are read"));
    EXPECT_THAT(nrrd("-20 20 20", encoding), HasSubstr("x.nrrd: "));
  }
}

TEST_F(ReadVolumeTest, AMetaImageOfAsManyAxesAsNoneHasIsRefusedAtOnce) {
  for (const char* axes : {"-92233720368", "2000000000", "0", "eleven"}) {
    WriteFileAtomically(
        folder_ / "x.mhd",
        fmt::format("ObjectType = Image\nNDims = {}\nDimSize = 4 4 4\nElementType = "
                    "MET_SHORT\nElementDataFile = x.raw\n",
                    axes));
    EXPECT_THAT(WordsOf<Error>([&] { Read("x.mhd"); }), HasSubstr("NDims")) << axes;
  }
}

TEST_F(ReadVolumeTest, FilesCutShortAreOneClearError) {
  const auto cut = [&](const char* name) {
    const std::string bytes = ReadFileBytes(folder_ / name);
    for (const std::size_t missing : {bytes.size() / 2, std::size_t{24}}) {
      WriteFileAtomically(folder_ / name, bytes.substr(0, bytes.size() - missing));
      EXPECT_THAT(Words(name), HasSubstr(fmt::format("{}: ", name))) << missing;
    }
  };
  WriteItk(folder_ / "a.nii", array_, *itk::NiftiImageIO::New());
  WriteItk(folder_ / "a.nrrd", array_, *itk::NrrdImageIO::New());
  WriteItk(folder_ / "a.mha", array_, *itk::MetaImageIO::New());
  cut("a.nii");
  cut("a.nrrd");
  cut("a.mha");
}

// What the program writes itself.
TEST_F(ReadVolumeTest, AWrittenVolumeIsReadBackWithItsPlace) {
  for (const char* name : {"head.nii.gz", "head.nrrd", "head.mha"}) {
    WriteImageVolume(head_.volume, folder_ / name, VolumeFormatOf(name).value());
    ExpectTheHead(Read(name));
  }
  EXPECT_FALSE(VolumeFormatOf("head.dcm"));
  EXPECT_THROW(WriteImageVolume(head_.volume, folder_ / "no/head.nrrd", VolumeFormat::kNrrd),
               IoError);
}

}  // namespace
}  // namespace semblance
