// SPDX-License-Identifier: GPL-3.0-or-later
// Everyday mistakes in volumes: each is refused, or read correctly with a note.
#include "problems/io/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which otherwise includes parts of an older one

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkMetaImageIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <locale>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "problems/io/volumes/import_ct.h"
#include "tests/testing/volume_files.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using testing::Gzipped;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::PutAt;
using testing::SliceWords;
using testing::WordsOf;
using testing::WriteDicom;
using testing::WriteDicomSlice;
using testing::WriteItk;

// ---------------------------------------------------------------------------------------------
// Files of ../shared/data/field, whose README states the right extents
// ---------------------------------------------------------------------------------------------

class FieldVolumesTest : public testing::VolumeFilesTest {
 protected:
  void SetUp() override {
    if (!fs::exists(kField)) {
      GTEST_SKIP() << kField << " is not here";
    }
  }

  // Unpacks the files of a .tar.gz into a folder of its name.
  fs::path Unpacked(const std::string& name) const {
    const fs::path folder = folder_ / name;
    fs::create_directories(folder);
    archive* const a = archive_read_new();
    archive_read_support_filter_gzip(a);
    archive_read_support_format_tar(a);
    EXPECT_EQ(archive_read_open_filename(a, (kField / (name + ".tar.gz")).c_str(), 10240), 0);
    for (archive_entry* entry = nullptr; archive_read_next_header(a, &entry) == ARCHIVE_OK;) {
      std::string bytes(static_cast<std::size_t>(archive_entry_size(entry)), ' ');
      if (archive_entry_filetype(entry) == AE_IFREG) {
        EXPECT_EQ(archive_read_data(a, bytes.data(), bytes.size()),
                  static_cast<la_ssize_t>(bytes.size()));
        WriteFileAtomically(folder / fs::path(archive_entry_pathname(entry)).filename(), bytes,
                            Durability::kUnsynced);
      }
    }
    archive_read_free(a);
    return folder;
  }

  static void ExpectBox(const TriMesh& mesh, const Vec3& low, const Vec3& high,
                        const Vec3& tolerance_mm) {
    const Box3 box = Bounds(mesh);
    for (int a = 0; a < 3; ++a) {
      EXPECT_NEAR(box.min()[a], low[a], tolerance_mm[a]) << a;
      EXPECT_NEAR(box.max()[a], high[a], tolerance_mm[a]) << a;
    }
  }

  static void ExpectTheBall(const VolumeReading& reading, double z_mm = 0.6) {
    const CtImport import = ImportCt(reading.volume, {}, {});
    const Vec3 tolerance_mm(0.6, 0.6, z_mm);
    ExpectBox(import.skull, {-67, -83, -87}, {67, 83, 87}, tolerance_mm);
    ExpectBox(import.skin, {-70, -110, -98}, {86, 94, 98}, tolerance_mm);
  }

  const fs::path kField = SEMBLANCE_SOURCE_DIR "/../shared/data/field";
};

TEST_F(FieldVolumesTest, TheHeadIsReadInEveryForm) {
  ExpectTheBall(ReadVolume(Unpacked("dicom-whole"), {}, {}));
  for (const auto& [name, note] :
       {std::pair("dicom-no-preamble", "series 2"), std::pair("dicom-enhanced", "27 slices"),
        std::pair("dicom-modality-ot", "neither CT nor MR"),
        std::pair("dicom-latin1", "Schädel nativ")}) {
    SCOPED_TRACE(name);
    const VolumeReading reading = ReadVolume(Unpacked(name), {}, {});
    EXPECT_THAT(reading.notes, Contains(HasSubstr(note)));
    ExpectTheBall(reading);
  }
  const VolumeReading uneven = ReadVolume(Unpacked("dicom-6-then-9-mm"), {}, {});
  EXPECT_THAT(uneven.notes, Contains(HasSubstr("not at equal distances, 6.00 to 9.00 mm")));
  // Linear interpolation puts the first skin at -93.4 mm, between air at -98 and tissue at -92 mm.
  ExpectTheBall(uneven, 5);
}

TEST_F(FieldVolumesTest, NiftiFilesAreReadWithANote) {
  for (const auto& [name, note] :
       {std::pair("nan-outside", "6264 values are not numbers and count as air"),
        std::pair("qform-sform-differ", "180.0 deg; the sform is used"),
        std::pair("units-metre", "lengths are in m; multiplied by 1000"),
        std::pair("sform-unit-rows", "the steps are directions; multiplied by the size")}) {
    SCOPED_TRACE(name);
    const VolumeReading reading = ReadVolume(kField / (std::string(name) + ".nii.gz"), {}, {});
    EXPECT_THAT(reading.notes, Contains(HasSubstr(note)));
    ExpectTheBall(reading);
  }
}

TEST_F(FieldVolumesTest, ADecimalCommaIsReadAsAPoint) {
  const VolumeReading reading = ReadVolume(Unpacked("dicom-decimal-comma"), {}, {});
  EXPECT_THAT(reading.notes, Contains(AllOf(HasSubstr("27 slices have decimal commas"),
                                            HasSubstr("Pixel Spacing (0028,0030) '8,9\\8,9'"))));
  EXPECT_LT((reading.volume.spacing_mm - Vec3(8.9, 8.9, 8)).norm(), 1e-9);
  const Box3 skin = Bounds(ImportCt(reading.volume, {}, {}).skin);
  EXPECT_NEAR(skin.min().x(), -67, 1);
  EXPECT_NEAR(skin.max().x(), 107, 1);
}

TEST_F(FieldVolumesTest, CutSlicesAndAbsentTagsAreNamed) {
  EXPECT_THAT(WordsOf<Error>([&] { ReadVolume(Unpacked("dicom-one-slice-cut"), {}, {}); }),
              AllOf(HasSubstr("1 images cannot be used: IM"), HasSubstr("of its pixels")));
  EXPECT_THAT(WordsOf<Error>([&] { ReadVolume(Unpacked("dicom-eight-slices-cut"), {}, {}); }),
              AllOf(HasSubstr("8 images cannot be used: IM"), HasSubstr("and 4 more")));
  EXPECT_THAT(WordsOf<Error>([&] { ReadVolume(Unpacked("dicom-no-pixel-spacing"), {}, {}); }),
              HasSubstr("27 images left out, because they lack Pixel Spacing (0028,0030)"));
}

// ---------------------------------------------------------------------------------------------
// DICOM
// ---------------------------------------------------------------------------------------------

class DicomMistakesTest : public testing::VolumeFilesTest {
 protected:
  fs::path Slice(int k) const {
    return folder_ / "ct" / fmt::format("IM{:03}", (k * 37 + 11) % 101);
  }
  // Replaces a text in the file of a slice by one of the same length.
  void Replace(int k, std::string_view from, std::string to) const {
    ASSERT_LE(to.size(), from.size());
    to.resize(from.size(), ' ');
    std::string bytes = ReadFileBytes(Slice(k));
    const std::size_t at = bytes.find(from);
    ASSERT_NE(at, bytes.npos) << from;
    WriteFileAtomically(Slice(k), bytes.replace(at, from.size(), to), Durability::kUnsynced);
  }
  void WriteSlice(int k, const SliceWords& words) const {
    WriteDicomSlice(Slice(k), array_, k, words);
  }
};

// Law: no cut of a slice's file is accepted, wherever it is.
TEST_F(DicomMistakesTest, NoCutIsAccepted) {
  for (const char* compression : {"", "JPEG"}) {
    WriteDicom(folder_ / "ct", array_, {.compression = compression});
    ASSERT_NO_THROW(Read("ct")) << compression;
    const std::string whole = ReadFileBytes(Slice(12));
    for (const double share : {0.0, 0.01, 0.03, 0.05, 0.1, 0.3, 0.6, 0.9, 0.999}) {
      const auto size = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
      WriteFileAtomically(Slice(12), whole.substr(0, size), Durability::kUnsynced);
      EXPECT_THAT(Words("ct"), HasSubstr(Slice(12).filename().string()))
          << compression << " " << share;
    }
    WriteFileAtomically(Slice(12), whole.substr(0, whole.size() - 2), Durability::kUnsynced);
    EXPECT_THAT(Words("ct"), HasSubstr("cannot be used")) << compression;
  }
}

TEST_F(DicomMistakesTest, ALostInterceptIsRefused) {
  WriteDicom(folder_ / "ct", array_, {.intercept = -1024});
  ASSERT_NO_THROW(Read("ct"));
  Replace(9, "-1024", "0");
  EXPECT_THAT(Words("ct"), AllOf(HasSubstr("1024 higher than"), HasSubstr("0028,1052"),
                                 HasSubstr(Slice(9).filename().string())));
  WriteSlice(9, {.intercept = -1024});
  Replace(9, std::string_view("\x28\0\x52\x10", 4), {"\x28\0\x51\x10", 4});
  EXPECT_THAT(Words("ct"), AllOf(HasSubstr("1 slices differ from the others in having a Rescale "
                                           "Intercept (0028,1052) or none"),
                                 HasSubstr(Slice(9).filename().string())));
  WriteSlice(9, {.slope = 2, .intercept = -1024});
  EXPECT_THAT(Words("ct"), HasSubstr("1 slices differ from the others in Rescale Slope"));
}

TEST_F(DicomMistakesTest, AnotherPersonsSliceIsRefused) {
  for (const auto& [tag, name] :
       {std::pair("0010|0020", "Patient ID"), std::pair("0010|0010", "Patient Name"),
        std::pair("0010|0030", "Birth Date"), std::pair("0020|0052", "Frame of Reference")}) {
    SliceWords one, two;
    one.more = {{tag, "1975"}};
    two.more = {{tag, "1976"}};
    WriteDicom(folder_ / "ct", array_, one);
    ASSERT_NO_THROW(Read("ct")) << name;
    WriteSlice(20, two);
    EXPECT_THAT(Words("ct"), AllOf(HasSubstr("1 slices differ from the others in "),
                                   HasSubstr(name), HasSubstr(Slice(20).filename().string())));
  }
}

TEST_F(DicomMistakesTest, ImpossibleNumbersAreRefusedWithTheirTag) {
  for (const auto& [from, to, words] :
       {std::array{"2.5\\2.5", "-2.5\\2", "Pixel Spacing (0028,0030) is -2.5 and 2 mm"},
        std::array{"2.5\\2.5", "0\\2.5", "Pixel Spacing (0028,0030) is 0 and"},
        std::array{"2.5\\2.5", "2.5x\\2", "Pixel Spacing (0028,0030) is '2.5x\\2'"},
        std::array{"2.5\\2.5", "2.5", "which is not 2 numbers"},
        std::array{"1\\0\\0\\0\\1\\0", "1\\0\\0\\1\\0\\0", "at right angles"}}) {
    WriteDicom(folder_ / "ct", array_);
    Replace(15, from, to);
    EXPECT_THAT(Words("ct"), AllOf(HasSubstr("1 images cannot be used"), HasSubstr(words)));
  }
}

TEST_F(DicomMistakesTest, SlicesWithAUidEachAreOneSeries) {
  fs::create_directories(folder_ / "ct");
  for (int k = 0; k < array_.counts[2]; ++k) {
    WriteSlice(k, {.series = fmt::format("1.2.3.{}", k + 1)});
  }
  const VolumeReading reading = Read("ct");
  ExpectTheHead(reading);
  EXPECT_THAT(reading.notes, Contains(HasSubstr("slices have a series UID each")));
}

TEST_F(DicomMistakesTest, ASliceOfAnotherGridIsReportedAndRoundingIsNot) {
  WriteDicom(folder_ / "ct", array_);
  VoxelArray other = array_;
  other.steps.col(0) *= 2.5003 / 2.5;  // rounded: 3e-4 mm
  WriteDicomSlice(Slice(3), other, 3, {});
  EXPECT_THAT(Read("ct").notes, Not(Contains(HasSubstr("left out"))));
  other.steps.col(0) *= 1.1;
  WriteDicomSlice(folder_ / "ct/extra", other, 3, {});
  const VolumeReading reading = Read("ct");
  EXPECT_THAT(reading.notes,
              Contains(AllOf(HasSubstr("series left out: 1:"), HasSubstr("1 slices of"))));
  EXPECT_EQ(reading.volume.slices, array_.counts[2]);
}

// Half as many slices of another size are no second head; as many of them may be.
TEST_F(DicomMistakesTest, TheMainGridOfASeriesIsTaken) {
  WriteDicom(folder_ / "ct", array_);
  VoxelArray other = array_;
  other.steps.col(0) *= 1.3;
  const int half = array_.counts[2] / 2;
  for (int k = 0; k < half; ++k) {
    WriteDicomSlice(folder_ / "ct" / fmt::format("other{}", k), other, k, {});
  }
  const VolumeReading reading = Read("ct");
  EXPECT_EQ(reading.volume.slices, array_.counts[2]);
  EXPECT_THAT(reading.notes, Contains(AllOf(HasSubstr("series left out: 1:"),
                                            HasSubstr(fmt::format("{} slices of", half)))));
  for (int k = half; k < array_.counts[2]; ++k) {
    WriteDicomSlice(folder_ / "ct" / fmt::format("other{}", k), other, k, {});
  }
  EXPECT_THAT(Words("ct"), HasSubstr("2 series; choose one"));
}

TEST_F(DicomMistakesTest, EverySecondSliceMissingIsNoted) {
  WriteDicom(folder_ / "ct", array_, {.more = {{"0018|0050", "3.5"}}});
  for (int k = 1; k < array_.counts[2]; k += 2) {
    fs::remove(Slice(k));
  }
  const VolumeReading reading = Read("ct");
  EXPECT_THAT(reading.notes, Contains(HasSubstr("3.5 mm thick and 7 mm apart")));
  EXPECT_THAT(reading.notes, Contains(HasSubstr("numbered in steps of 2")));
}

TEST_F(DicomMistakesTest, ACopyInThePlaceOfASliceIsNoted) {
  const auto copied = Contains(HasSubstr("neighbouring slices have the same values"));
  for (std::size_t n = 0; n < array_.values.size(); ++n) {
    array_.values[n] += static_cast<std::int16_t>(n * 2654435761U >> 30 & 3);  // noise, as in scans
  }
  WriteDicom(folder_ / "ct", array_);
  EXPECT_THAT(Read("ct").notes, Not(copied));
  const std::ptrdiff_t size = std::ptrdiff_t{array_.counts[0]} * array_.counts[1];
  const auto slice = array_.values.begin() + 15 * size;
  std::copy(slice, slice + size, slice + size);
  WriteDicom(folder_ / "ct", array_);
  EXPECT_THAT(Read("ct").notes, copied);
}

TEST_F(DicomMistakesTest, AFaultOfAllSlicesIsNamed) {
  WriteDicom(folder_ / "ct", array_);
  for (int k = 0; k < array_.counts[2]; ++k) {
    Replace(k, "2.5\\2.5", "2.5x\\2");
  }
  EXPECT_THAT(Words("ct"), AllOf(HasSubstr("no file of"), HasSubstr("Pixel Spacing (0028,0030)")));
}

TEST_F(DicomMistakesTest, AnEmptyFileAmongSlicesIsRefused) {
  WriteDicom(folder_ / "ct", array_);
  WriteFileAtomically(folder_ / "ct/index.html", "");
  ExpectTheHead(Read("ct"));
  WriteFileAtomically(folder_ / "ct/IM999", "");
  EXPECT_THAT(Words("ct"), HasSubstr("the file IM999 is empty or"));
}

TEST_F(DicomMistakesTest, TextsHoldNoControlCharacters) {
  WriteDicom(folder_ / "ct", array_, {.description = "a\x1b[31mb\x07"});
  for (const std::string& note : Read("ct").notes) {
    EXPECT_TRUE(std::ranges::none_of(note, [](char c) { return c >= 0 && c < ' '; })) << note;
  }
}

// ---------------------------------------------------------------------------------------------
// Numbers in a locale with decimal commas
// ---------------------------------------------------------------------------------------------

class DecimalComma : public std::numpunct<char> {
 protected:
  char do_decimal_point() const override { return ','; }
};

TEST_F(DicomMistakesTest, TheLocaleDoesNotMatter) {
  fs::create_directories(folder_ / "enc");
  WriteDicom(folder_ / "ct", array_);
  WriteNrrd("a.nrrd", "space: LPS\n" + testing::LpsDirections(array_, Vec3::Ones()));
  WriteItk(folder_ / "a.mha", array_, *itk::MetaImageIO::New());
  const std::locale before = std::locale::global(std::locale(std::locale(), new DecimalComma));
  const std::string encoded =
      EncodeDicomSlice(head_.volume, 3, {.patient = "P", .description = "d"});
  std::vector<VolumeReading> readings;
  for (const char* name : {"ct", "a.nrrd", "a.mha"}) {
    readings.push_back(Read(name));
  }
  std::locale::global(before);
  EXPECT_EQ(encoded, EncodeDicomSlice(head_.volume, 3, {.patient = "P", .description = "d"}));
  for (const VolumeReading& reading : readings) {
    ExpectTheHead(reading);
  }
}

// ---------------------------------------------------------------------------------------------
// NIfTI
// ---------------------------------------------------------------------------------------------

class NiftiMistakesTest : public testing::VolumeFilesTest {
 protected:
  static constexpr std::size_t kIntent = 68, kSizes = 76, kOffset = 108, kUnits = 123, kCodes = 252;
  static constexpr std::size_t kMatrix = 280, kMark = 344, kVoxels = 352;

  // The head with an sform alone.
  std::string SformBytes() const {
    std::string bytes = NiftiBytes();
    PutAt<std::int16_t>(kCodes, 0, bytes);
    PutAt<std::int16_t>(kCodes + 2, 1, bytes);
    for (int row = 0; row < 3; ++row) {
      const double ras = row < 2 ? -1 : 1;
      for (int column = 0; column < 3; ++column) {
        PutAt(kMatrix + 16 * row + 4 * column, static_cast<float>(ras * array_.steps(row, column)),
              bytes);
      }
      PutAt(kMatrix + 16 * row + 12, static_cast<float>(ras * array_.origin[row]), bytes);
    }
    return bytes;
  }
  VolumeReading ReadBytes(const std::string& bytes) const {
    WriteFileAtomically(folder_ / "a.nii", bytes);
    return Read("a.nii");
  }
  std::string WordsFor(const std::string& bytes) const {
    WriteFileAtomically(folder_ / "a.nii", bytes);
    return Words("a.nii");
  }
};

TEST_F(NiftiMistakesTest, EveryFormIsReadWithItsPlace) {
  const std::string bytes = SformBytes();
  ExpectTheHead(ReadBytes(bytes));
  std::string pair = bytes.substr(0, kVoxels);
  pair.replace(kMark, 3, "ni1");
  PutAt(kOffset, 0.0F, pair);
  WriteFileAtomically(folder_ / "b.hdr", pair);
  EXPECT_THAT(Words("b.hdr"), HasSubstr("b.img with its voxels is missing"));
  WriteFileAtomically(folder_ / "b.img", bytes.substr(kVoxels));
  ExpectTheHead(Read("b.hdr"));
  fs::remove(folder_ / "b.img");
  WriteFileAtomically(folder_ / "b.img.gz", Gzipped(bytes.substr(kVoxels)));
  ExpectTheHead(Read("b.hdr"));
  // NIfTI-2: wider fields in another order.
  std::string second(544, '\0');
  PutAt<std::int32_t>(0, 540, second);
  second.replace(4, 3, "n+2");
  PutAt<std::int16_t>(12, 4, second);
  PutAt<std::int64_t>(16, 3, second);
  PutAt<std::int64_t>(168, 544, second);
  for (int a = 0; a < 3; ++a) {
    PutAt<std::int64_t>(24 + 8 * a, array_.counts[a], second);
    PutAt<double>(112 + 8 * a, array_.steps.col(a).norm(), second);
  }
  PutAt<std::int32_t>(348, 1, second);
  for (int row = 0; row < 3; ++row) {
    const double ras = row < 2 ? -1 : 1;
    for (int column = 0; column < 3; ++column) {
      PutAt<double>(400 + 32 * row + 8 * column, ras * array_.steps(row, column), second);
    }
    PutAt<double>(424 + 32 * row, ras * array_.origin[row], second);
  }
  ExpectTheHead(ReadBytes(second + bytes.substr(kVoxels)));
  EXPECT_THAT(WordsFor(second + bytes.substr(kVoxels, 5000)), HasSubstr("cut short"));
}

TEST_F(NiftiMistakesTest, ContradictionsAreNotedOrRefused) {
  std::string bytes = SformBytes();
  for (int a = 1; a <= 3; ++a) {
    PutAt(kSizes + 4 * a, 1.7F, bytes);  // not the length of the sform's columns
  }
  EXPECT_THAT(WordsFor(bytes), HasSubstr("its voxels a size of 1.7 x 1.7 x 1.7 (pixdim)"));
  PutAt<std::int16_t>(kCodes + 2, 4, bytes = SformBytes());
  EXPECT_THAT(ReadBytes(bytes).notes, Contains(HasSubstr("standard space (code 4)")));
  PutAt<std::int16_t>(kIntent, 1002, bytes = SformBytes());
  EXPECT_THAT(ReadBytes(bytes).notes, Contains(HasSubstr("intent_code is 1002")));
  bytes = NiftiBytes();
  PutAt<std::int16_t>(kCodes, 1, bytes);
  PutAt<std::int16_t>(kCodes + 2, 0, bytes);
  PutAt(kSizes + 4, -2.5F, bytes);
  EXPECT_THAT(WordsFor(bytes), HasSubstr("size of -2.5 x"));
  EXPECT_THAT(WordsFor(SformBytes().replace(kMark, 3, "xyz")), HasSubstr("lacks the mark"));
}

TEST_F(NiftiMistakesTest, ASkewSformIsFollowedAndNoted) {
  std::string bytes = SformBytes();
  const double shift = std::tan(0.2) * array_.steps(2, 2), length = array_.steps(2, 2);
  PutAt(kMatrix + 16 + 8, static_cast<float>(-shift), bytes);  // y of the step between slices
  PutAt(kSizes + 12, static_cast<float>(std::hypot(shift, length)), bytes);
  const VolumeReading reading = ReadBytes(bytes);
  EXPECT_THAT(reading.notes, Contains(HasSubstr("tilted by 11.5 deg")));
  EXPECT_LT(
      (reading.volume.World(0, 0, 10) - reading.volume.origin - Vec3(0, 10 * shift, 10 * length))
          .norm(),
      1e-4);
  PutAt(kMatrix + 16 + 8, static_cast<float>(-1.2 * length), bytes);
  PutAt(kSizes + 12, static_cast<float>(std::hypot(1.2, 1) * length), bytes);
  EXPECT_THAT(WordsFor(bytes), HasSubstr("off right angles"));
}

// ---------------------------------------------------------------------------------------------
// MetaImage
// ---------------------------------------------------------------------------------------------

class MetaMistakesTest : public testing::VolumeFilesTest {
 protected:
  std::string Place() const {
    const Vec3& o = array_.origin;
    return fmt::format("TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = {} {} {}\n", o.x(), o.y(),
                       o.z());
  }
};

// A range of slices whose values have another offset, as of a second series in one volume.
TEST_F(MetaMistakesTest, APartOfTheSlicesWithAnotherOffsetIsNoted) {
  const std::string header = Place() + "ElementSpacing = 2.5 2.5 3.5\n";
  const auto noted = Contains(HasSubstr("most values change by one amount between"));
  WriteMetaImage("a.mha", header);
  EXPECT_THAT(Read("a.mha").notes, Not(noted));
  const auto size = static_cast<std::size_t>(array_.counts[0]) * array_.counts[1];
  for (std::size_t n = 8 * size; n < 12 * size; ++n) {
    array_.values[n] = static_cast<std::int16_t>(array_.values[n] + 150);
  }
  WriteMetaImage("b.mha", header);
  EXPECT_THAT(Read("b.mha").notes,
              Contains(HasSubstr("slices 8 and 9 (+150), slices 12 and 13 (-150)")));
}

TEST_F(MetaMistakesTest, FieldsThatTheLibraryIgnoresAreReadOrRefused) {
  const std::string spacing = "ElementSpacing = 2.5 2.5 3.5\n";
  WriteMetaImage("a.mha", Place() + spacing);
  ExpectTheHead(Read("a.mha"));
  for (const auto& [lines, words] :
       {std::pair("ElementSpacing = 2,5 2,5 3,5\n", "ElementSpacing in its header is"),
        std::pair("ElementSpacing = 2.5 2.5\n", "which is not 3 numbers"),
        std::pair("elementspacing = 2.5 2.5 3.5\n", "write 'ElementSpacing'"),
        std::pair("ElementSpacing = 1 1 1\nElementSpacing = 2.5 2.5 3.5\n", "twice"),
        std::pair("ElementSpacing = -2.5 2.5 3.5\n", "a.mha: "),
        std::pair("ElementSpacing = 2.5 2.5 3.5\nElementByteOrderMSB = True\n", "contradict"),
        std::pair("ElementSpacing = 2.5 2.5 3.5\nElementNumberOfChannels = 3\n", "a.mha: "),
        std::pair("ElementSpacing = 2.5 2.5 3.5\nHeaderSize = 8\n", "HeaderSize = 8 beside"),
        std::pair("ElementSpacing = 2.5 2.5 3.5\nCompressedData = True\n",
                  "lacks CompressedDataSize")}) {
    WriteMetaImage("a.mha", Place() + lines);
    EXPECT_THAT(Words("a.mha"), HasSubstr(words)) << lines;
  }
  WriteMetaImage("a.mha", spacing + "AnatomicalOrientation = LSA\n");
  EXPECT_THAT(Words("a.mha"), HasSubstr("AnatomicalOrientation = LSA but no TransformMatrix"));
}

TEST_F(MetaMistakesTest, LettersThatContradictTheMatrixAreNoted) {
  const auto contradicts = Contains(HasSubstr("its TransformMatrix gives RAI"));
  for (const char* const letters : {"RAI", "LPS", "???"}) {  // both conventions, and unknown
    WriteMetaImage("a.mha", fmt::format("{}ElementSpacing = 2.5 2.5 3.5\nAnatomicalOrientation = "
                                        "{}\n",
                                        Place(), letters));
    EXPECT_THAT(Read("a.mha").notes, Not(contradicts)) << letters;
  }
  WriteMetaImage("a.mha", Place() + "ElementSpacing = 2.5 2.5 3.5\nAnatomicalOrientation = LPI\n");
  EXPECT_THAT(Read("a.mha").notes, contradicts);
}

TEST_F(MetaMistakesTest, TheSlopeOfTheValuesIsApplied) {
  for (std::int16_t& value : array_.values) {
    value = static_cast<std::int16_t>(value + 1024);
  }
  WriteMetaImage("a.mha", Place() +
                              "ElementSpacing = 2.5 2.5 3.5\nElementToIntensityFunctionSlope = "
                              "1\nElementToIntensityFunctionOffset = -1024\n");
  const VolumeReading reading = Read("a.mha");
  ExpectTheHead(reading);
  EXPECT_THAT(reading.notes, Contains(HasSubstr("-1024 was added")));
}

// ---------------------------------------------------------------------------------------------
// Values and sizes
// ---------------------------------------------------------------------------------------------

class VolumeValuesTest : public testing::VolumeFilesTest {
 protected:
  CtVolume Mapped(double slope, double shift) const {
    CtVolume volume = head_.volume;
    for (std::int16_t& value : volume.values) {
      value = static_cast<std::int16_t>(
          std::lround(std::clamp(slope * value + shift, -32768.0, 32767.0)));
    }
    return volume;
  }
  std::string WordsFor(const CtVolume& volume, const CtImportOptions& options = {}) const {
    return WordsOf<InputError>([&] { ImportCt(volume, options, {}); });
  }
};

TEST_F(VolumeValuesTest, AShiftOrFactorOfTheValuesIsNamed) {
  EXPECT_THAT(ImportCt(head_.volume, {}, {}).notes, Not(Contains(HasSubstr("soft tissue"))));
  EXPECT_THAT(WordsFor(Mapped(1, 1024)), HasSubstr("the values look 1024 too high"));
  EXPECT_THAT(WordsFor(Mapped(1, -1024)), HasSubstr("the values look 1024 too low"));
  EXPECT_THAT(WordsFor(Mapped(1, -3000)), HasSubstr("the values look 3000 too low"));
  for (const double slope : {0.1, 0.25, 0.5, 2.0, 4.0}) {
    EXPECT_THAT(WordsFor(Mapped(slope, 0)),
                HasSubstr(fmt::format("the values look scaled by {:.3g}", slope)));
    EXPECT_THAT(WordsFor(Mapped(slope, 1000 * slope - 1000)), HasSubstr("look scaled by"));
  }
}

// Values above 600 HU in 12 bits with an offset of 1024 and a limit of 1624.
TEST_F(VolumeValuesTest, BoneThatHasWrappedAroundIsNoted) {
  const auto wrapped = Contains(HasSubstr("may have wrapped around"));
  EXPECT_THAT(ImportCt(head_.volume, {}, {}).notes, Not(wrapped));
  CtVolume volume = head_.volume;
  for (std::int16_t& value : volume.values) {
    value = value > 600 ? static_cast<std::int16_t>(value - 4096) : value;
  }
  EXPECT_THAT(ImportCt(volume, {.bone_hu = 226}, {}).notes, wrapped);
}

TEST_F(VolumeValuesTest, ThresholdsThatSuitOtherValuesAreAccepted) {
  const CtVolume volume = Mapped(0.7, 100);
  EXPECT_THAT(WordsFor(volume), HasSubstr("set skin_hu and bone_hu to about -39 and 259"));
  const CtImport import = ImportCt(volume, {.bone_hu = 259, .skin_hu = -39}, {});
  EXPECT_THAT(import.notes, Contains(HasSubstr("scaled by 0.7")));
}

TEST_F(VolumeValuesTest, ValuesThatFillTheCornersAreNotAir) {
  CtVolume padded = head_.volume;
  for (int k = 0; k < padded.slices; ++k) {
    for (int j = 0; j < padded.rows; ++j) {
      for (int i = 0; i < padded.columns; ++i) {
        const double x = 2.0 * i / (padded.columns - 1) - 1, y = 2.0 * j / (padded.rows - 1) - 1;
        std::int16_t& value = padded.values[padded.Index(i, j, k)];
        value = x * x + y * y > 1 ? -2000 : value;
      }
    }
  }
  EXPECT_THAT(ImportCt(padded, {}, {}).notes, Not(Contains(HasSubstr("soft tissue"))));
  for (std::int16_t& value : padded.values) {
    value = static_cast<std::int16_t>(value + 1024);
  }
  EXPECT_THAT(WordsFor(padded), HasSubstr("the values look 1024 too high"));
}

TEST_F(VolumeValuesTest, TheHeadsSizeAlongEachAxisIsChecked) {
  EXPECT_THAT(ImportCt(head_.volume, {}, {}).notes, Not(Contains(HasSubstr("check the spacing"))));
  for (const auto& [axis, factor, words] :
       {std::tuple(0, 0.5, "wide"), std::tuple(1, 0.5, "mm long"), std::tuple(0, 2.2, "wide"),
        std::tuple(1, 1.9, "mm long")}) {
    CtVolume volume = head_.volume;
    volume.spacing_mm[axis] *= factor;
    volume.origin[axis] *= factor;
    try {
      EXPECT_THAT(ImportCt(volume, {}, {}).notes,
                  Contains(AllOf(HasSubstr(words), HasSubstr("check the spacing"))))
          << axis << " " << factor;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), AllOf(HasSubstr(words), HasSubstr("check the spacing")));
    }
  }
}

TEST_F(VolumeValuesTest, TissueAtTheSidesIsRefused) {
  CtVolume filled = head_.volume;
  for (int k = 0; k < filled.slices; ++k) {
    for (int j = 0; j < filled.rows; ++j) {
      for (int i = 0; i < filled.columns; ++i) {
        const bool is_side = std::min({i, j, filled.columns - 1 - i, filled.rows - 1 - j}) < 2;
        filled.values[filled.Index(i, j, k)] =
            is_side ? std::int16_t{0} : filled.values[filled.Index(i, j, k)];
      }
    }
  }
  EXPECT_THAT(WordsFor(filled), AnyOf(HasSubstr("tissue covers the sides"), HasSubstr("no air")));
}

}  // namespace
}  // namespace semblance::problems
