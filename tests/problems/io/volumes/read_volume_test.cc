// SPDX-License-Identifier: GPL-3.0-or-later
// Tests of NIfTI, NRRD and MetaImage files, and of the faults of all formats.
#include "problems/io/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which otherwise includes parts of an older one

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <array>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "tests/testing/volume_files.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::BytesOf;
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

TEST_F(ReadVolumeTest, EachFormatIsReadWithItsPlace) {
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
  // In RAS x and y are negated.
  WriteFileAtomically(
      folder_ / "big.nrrd",
      fmt::format("NRRD0004\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: "
                  "{}\nspace directions: (-2.5,0,0) (0,-2.5,0) (0,0,3.5)\nkinds: domain domain "
                  "domain\nendian: big\nencoding: raw\nspace origin: ({},{},{})\n\n{}",
                  sizes, -o.x(), -o.y(), o.z(), swapped));
  ExpectTheHead(Read("big.nrrd"));
}

TEST_F(ReadVolumeTest, AFileWithoutOrientationIsNoted) {
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
    EXPECT_THAT(reading.notes,
                Contains(AllOf(HasSubstr("the file does not state its orientation ("),
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

TEST_F(ReadVolumeTest, LengthsInTheUnitOfTheHeaderAreConverted) {
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
  EXPECT_THAT(Read("a.nrrd").notes, Contains(HasSubstr("in 'el', which is an unknown unit")));
  WriteNrrd("a.nrrd", "spacings: .25 .25 .35\nunits: \"cm\" \"cm\" \"cm\"\n");
  EXPECT_LT((Read("a.nrrd").volume.spacing_mm - Vec3(2.5, 2.5, 3.5)).norm(), 1e-6);
}

TEST_F(ReadVolumeTest, FloatsAreRoundedAndLabelsAreRefused) {
  WriteItk<float>(folder_ / "a.mha", array_, *itk::MetaImageIO::New());
  ExpectTheHead(Read("a.mha"));
  VoxelArray flat = array_;
  for (std::int16_t& value : flat.values) {
    value = value > 0 ? 1 : 0;
  }
  WriteItk(folder_ / "flat.nrrd", flat, *itk::NrrdImageIO::New());
  EXPECT_THAT(Words("flat.nrrd"), HasSubstr("run from 0 to 1 only"));
}

TEST_F(ReadVolumeTest, AFileWithoutAVolumeIsAClearError) {
  fs::create_directories(folder_ / "empty");
  WriteFileAtomically(folder_ / "empty/readme", "nothing here");
  WriteFileAtomically(folder_ / "text.nii", "dear reader");
  WriteFileAtomically(folder_ / "text.nrrd", "dear reader");
  WriteFileAtomically(folder_ / "text.mha", "dear reader");
  WriteFileAtomically(folder_ / "picture.png", "x");
  EXPECT_THAT(Words("none"), HasSubstr("no such file or folder"));
  EXPECT_THAT(Words("empty"), HasSubstr("none of the 1 files in the folder is DICOM"));
  EXPECT_THAT(Words("text.nii"), HasSubstr("it is not a NIfTI file"));
  EXPECT_THAT(Words("text.nrrd"), HasSubstr("it is not a NRRD file"));
  EXPECT_THAT(Words("text.mha"), HasSubstr("it is not a MetaImage file"));
  EXPECT_THAT(Words("picture.png"), HasSubstr("not a kind of volume"));
  EXPECT_THAT(Words("text.nii", {.series = "1"}), HasSubstr("are for folders of DICOM"));
}

// Such headers are refused before memory is allocated.
TEST_F(ReadVolumeTest, ClaimsBeyondTheFileAreRefused) {
  const auto mha = [&](const char* spacing, const char* sizes, const char* compressed) {
    WriteFileAtomically(
        folder_ / "x.mha",
        fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
                    "False\nCompressedData = {}\nCompressedDataSize = 8\nTransformMatrix = 1 0 0 0 "
                    "1 0 0 0 1\nOffset = 0 0 "
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

TEST_F(ReadVolumeTest, AMetaImageWithAnImpossibleNumberOfAxesIsRefused) {
  for (const char* axes : {"-92233720368", "2000000000", "0", "eleven"}) {
    WriteFileAtomically(
        folder_ / "x.mhd",
        fmt::format("ObjectType = Image\nNDims = {}\nDimSize = 4 4 4\nElementType = "
                    "MET_SHORT\nElementDataFile = x.raw\n",
                    axes));
    EXPECT_THAT(WordsOf<Error>([&] { Read("x.mhd"); }), HasSubstr("NDims")) << axes;
  }
}

TEST_F(ReadVolumeTest, AFileCutShortIsAClearError) {
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

TEST_F(ReadVolumeTest, AVolumeIsWrittenAndReadBackWithItsPlace) {
  for (const char* name : {"head.nii.gz", "head.nrrd", "head.mha"}) {
    WriteImageVolume(head_.volume, folder_ / name, FindVolumeFormat(name).value());
    ExpectTheHead(Read(name));
  }
  EXPECT_FALSE(FindVolumeFormat("head.dcm"));
  EXPECT_THROW(WriteImageVolume(head_.volume, folder_ / "no/head.nrrd", VolumeFormat::kNrrd),
               IoError);
}

// ---------------------------------------------------------------------------------------------
// NIfTI
// ---------------------------------------------------------------------------------------------

// NIfTI's own frame is RAS. The test reads the rows of its matrix, bytes 280 to 327, without ITK.
TEST_F(ReadVolumeTest, TheFrameOfNiftiIsConvertedToLps) {
  WriteItk(folder_ / "a.nii", array_, *itk::NiftiImageIO::New());
  const std::string bytes = ReadFileBytes(folder_ / "a.nii");
  std::array<float, 12> rows;
  std::memcpy(rows.data(), bytes.data() + 280, sizeof rows);
  const Vec3 ras(rows[3], rows[7], rows[11]);
  EXPECT_LT((Read("a.nii").volume.origin - Vec3(-ras.x(), -ras.y(), ras.z())).norm(), 1e-3);
}

// ITK converts such voxels to floats, which need twice the bytes of the file.
TEST_F(ReadVolumeTest, ANiftiWithSlopeAndInterceptIsRead) {
  constexpr std::size_t kType = 70, kSlope = 112, kIntercept = 116, kVoxels = 352;
  std::string bytes = NiftiBytes().substr(0, kVoxels);
  std::vector<std::uint16_t> stored;
  for (const std::int16_t value : array_.values) {
    stored.push_back(static_cast<std::uint16_t>(value + 1024));
  }
  PutAt<std::int16_t>(kType, 512, bytes);
  PutAt(kSlope, 1.0F, bytes);
  PutAt(kIntercept, -1024.0F, bytes);
  bytes += BytesOf(stored);
  WriteFileAtomically(folder_ / "a.nii", bytes);
  WriteFileAtomically(folder_ / "a.nii.gz", Gzipped(bytes));
  ExpectTheHead(Read("a.nii"));
  ExpectTheHead(Read("a.nii.gz"));
  WriteFileAtomically(folder_ / "cut.nii", bytes.substr(0, bytes.size() - 2));
  EXPECT_THAT(Words("cut.nii"), HasSubstr(fmt::format("cut short: {} bytes", 2 * stored.size())));
}

TEST_F(ReadVolumeTest, GzipWithSeveralMembersOrPaddingIsReadUnlessCutShort) {
  const std::string bytes = NiftiBytes();
  const std::string first = Gzipped(bytes.substr(0, bytes.size() / 3));
  const std::string both = first + Gzipped(bytes.substr(bytes.size() / 3));
  for (const std::string& whole : {both, both + std::string(512, '\0'), Gzipped(bytes)}) {
    WriteFileAtomically(folder_ / "a.nii.gz", whole);
    ExpectTheHead(Read("a.nii.gz"));
  }
  for (const std::size_t size : {both.size() - 1, both.size() - 9, both.size() / 2,
                                 first.size() + 5, first.size(), first.size() - 4}) {
    WriteFileAtomically(folder_ / "a.nii.gz", both.substr(0, size));
    EXPECT_THAT(Words("a.nii.gz"), HasSubstr("a.nii.gz: the file is cut short")) << size;
  }
}

TEST_F(ReadVolumeTest, ANiftiWithAnImpossiblePlaceIsRefused) {
  WriteItk(folder_ / "a.nii", array_, *itk::NiftiImageIO::New());
  const std::string sound = ReadFileBytes(folder_ / "a.nii");
  for (const float value : {-1.7e38F, std::numeric_limits<float>::quiet_NaN()}) {
    for (const std::size_t at : {80, 256, 284}) {  // a step, the quaternion, the matrix
      std::string bytes = sound;
      bytes[252] = bytes[254] = 1;
      std::memcpy(bytes.data() + at, &value, sizeof value);
      WriteFileAtomically(folder_ / "x.nii", bytes);
      WriteFileAtomically(folder_ / "x.nii.gz", Gzipped(bytes));
      for (const char* name : {"x.nii", "x.nii.gz"}) {
        EXPECT_THAT(Words(name), HasSubstr("numbers that place its voxels"));
      }
    }
  }
}

// ---------------------------------------------------------------------------------------------
// NRRD
// ---------------------------------------------------------------------------------------------

TEST_F(ReadVolumeTest, EverySpaceOfNrrdIsConvertedToLps) {
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

TEST_F(ReadVolumeTest, SpacesWithoutSidesAreNotedOrRefused) {
  const std::string directions = LpsDirections(array_, Vec3::Ones());
  for (const auto& [space, why] : {std::pair("space: scanner-xyz\n", "its space is scanner-xyz"),
                                   std::pair("space: 3D-right-handed\n", "is 3D-right-handed"),
                                   std::pair("space dimension: 3\n", "has no 'space'")}) {
    WriteNrrd("a.nrrd", space + directions);
    const VolumeReading reading = Read("a.nrrd");
    ExpectTheHead(reading);
    EXPECT_THAT(reading.notes, Contains(AllOf(HasSubstr("does not state its orientation"),
                                              HasSubstr(why), HasSubstr("taken as LPS"))));
  }
  WriteNrrd("a.nrrd", "space: 3D-left-handed\n" + directions);
  EXPECT_THAT(Words("a.nrrd"), AllOf(HasSubstr("mirror image"), HasSubstr("(LAS)")));
  for (const char* none : {"RPS", "LPI", "3DRH"}) {
    WriteNrrd("a.nrrd", fmt::format("space: {}\n{}", none, directions));
    EXPECT_THAT(Words("a.nrrd"), HasSubstr(fmt::format("'{}' is not a space of NRRD", none)));
  }
  WriteNrrd("a.nrrd", "space: LPS\nspace directions: (1,0) (0,1) (1,1)\n");
  EXPECT_THAT(Words("a.nrrd"), HasSubstr("not vectors of three numbers"));
}

}  // namespace
}  // namespace semblance::problems
