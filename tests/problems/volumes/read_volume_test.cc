// SPDX-License-Identifier: GPL-3.0-or-later
// A phantom's head in every kind of file, written by ITK and read back.
#include "problems/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which else brings a part of an older one

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "problems/ct/import_ct.h"
#include "problems/ct/mr_skin.h"
#include "problems/phantom/phantom_ct.h"
#include "problems/volumes/itk_files.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/mesh/mesh_query.h"
#include "tests/testing/itk_writers.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;
using testing::SliceWords;
using testing::WordsOf;
using testing::WriteDicom;
using testing::WriteItk;

struct Head {
  Phantom phantom = MakePhantom({.rings = 40});
  CtVolume volume = VoxelisePhantom(phantom, {.pixel_mm = 2.5, .slice_mm = 3.5});
};

const Head& TheHead() {
  static const Head head;
  return head;
}

VoxelArray ArrayOf(const CtVolume& volume) {
  VoxelArray array;
  array.counts = {volume.columns, volume.rows, volume.slices};
  array.origin = volume.origin;
  array.steps = volume.axes * volume.spacing_mm.asDiagonal();
  array.values = volume.values;
  return array;
}

// The same voxels as a file may have them: sagittal slices, rows from above, from left to right.
VoxelArray SagittalArrayOf(const CtVolume& v) {
  VoxelArray array;
  array.counts = {v.rows, v.slices, v.columns};
  array.origin = v.World(v.columns - 1, 0, v.slices - 1);
  array.steps << v.spacing_mm.y() * v.axes.col(1), -v.spacing_mm.z() * v.axes.col(2),
      -v.spacing_mm.x() * v.axes.col(0);
  for (int i = v.columns - 1; i >= 0; --i) {
    for (int k = v.slices - 1; k >= 0; --k) {
      for (int j = 0; j < v.rows; ++j) {
        array.values.push_back(v.values[v.Index(i, j, k)]);
      }
    }
  }
  return array;
}

// The values as a grid elsewhere in space has them.
CtVolume Resampled(const CtVolume& from, CtVolume to) {
  to.values.resize(to.Index(0, 0, to.slices));
  for (int k = 0; k < to.slices; ++k) {
    for (int j = 0; j < to.rows; ++j) {
      for (int i = 0; i < to.columns; ++i) {
        to.values[to.Index(i, j, k)] = static_cast<std::int16_t>(SampleHu(from, to.World(i, j, k)));
      }
    }
  }
  return to;
}

// Bytes of the machine, which are little-endian.
template <class Value>
std::string BytesOf(const std::vector<Value>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)};
}

template <class Value>
void PutAt(std::size_t at, Value value, std::string& bytes) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

// One member.
std::string Gzipped(const std::string& bytes) {
  std::string packed(bytes.size() + 1000, ' ');
  std::size_t used = 0;
  archive* a = archive_write_new();
  archive_write_add_filter_gzip(a);
  archive_write_set_format_raw(a);
  archive_write_set_bytes_in_last_block(a, 1);
  archive_write_open_memory(a, packed.data(), packed.size(), &used);
  archive_entry* entry = archive_entry_new();
  archive_entry_set_filetype(entry, AE_IFREG);
  archive_write_header(a, entry);
  archive_write_data(a, bytes.data(), bytes.size());
  archive_entry_free(entry);
  archive_write_free(a);
  packed.resize(used);
  return packed;
}

// Of an NRRD that lies in LPS, as its header says it.
std::string LpsDirections(const VoxelArray& a, const Vec3& to_space, const char* more = "") {
  std::string directions;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = to_space.cwiseProduct(a.steps.col(axis));
    directions += fmt::format("({},{},{}{}) ", step.x(), step.y(), step.z(), more);
  }
  const Vec3 origin = to_space.cwiseProduct(a.origin);
  return fmt::format("space directions: {}\nspace origin: ({},{},{}{})\n", directions, origin.x(),
                     origin.y(), origin.z(), more);
}

class ReadVolumeTest : public ::testing::Test {
 protected:
  VolumeReading Read(const fs::path& name, const ReadVolumeOptions& options = {}) const {
    return ReadVolume(folder_ / name, options, {});
  }
  std::string Words(const fs::path& name, const ReadVolumeOptions& options = {}) const {
    return WordsOf<Error>([&] { Read(name, options); });
  }

  // What was read is what was written, at the same places.
  void ExpectTheHead(const VolumeReading& reading) const {
    const CtVolume& read = reading.volume;
    ASSERT_EQ(read.columns, head_.volume.columns);
    ASSERT_EQ(read.rows, head_.volume.rows);
    ASSERT_EQ(read.slices, head_.volume.slices);
    EXPECT_EQ(read.values, head_.volume.values);
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(read.columns, read.rows, read.slices)}) {
      EXPECT_LT(
          (read.World(at.x(), at.y(), at.z()) - head_.volume.World(at.x(), at.y(), at.z())).norm(),
          1e-3);
    }
  }

  void WriteNrrd(const std::string& name, const std::string& lines) const {
    WriteFileAtomically(
        folder_ / name,
        fmt::format("NRRD0004\ntype: short\ndimension: 3\nsizes: {}\n{}endian: little\nencoding: "
                    "raw\n\n{}",
                    fmt::join(array_.counts, " "), lines, BytesOf(array_.values)));
  }
  void WriteMetaImage(const std::string& name, const std::string& lines) const {
    WriteFileAtomically(
        folder_ / name,
        fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = "
                    "False\n{}DimSize = {}\nElementType = MET_SHORT\nElementDataFile = LOCAL\n{}",
                    lines, fmt::join(array_.counts, " "), BytesOf(array_.values)));
  }
  std::string NiftiBytes() const {
    WriteItk(folder_ / "plain.nii", array_, *itk::NiftiImageIO::New());
    return ReadFileBytes(folder_ / "plain.nii");
  }

  // The skull of what was read lies within half a voxel of the phantom's, at its outer side.
  void ExpectTheSkull(const CtVolume& volume) const {
    const TriMesh skull = ImportCt(volume, {.bone_hu = 520}, {}).skull;
    const MeshQuery query(skull);
    double furthest = 0, sum = 0;
    for (const Vec3& p : head_.phantom.skull.points) {
      const double off = query.Closest(p).distance_mm;
      furthest = std::max(furthest, off);
      sum += off;
    }
    EXPECT_LT(furthest, 0.5 * volume.spacing_mm.norm());
    EXPECT_LT(sum / static_cast<double>(head_.phantom.skull.points.size()),
              0.25 * volume.spacing_mm.minCoeff());
  }

  const Head& head_ = TheHead();
  VoxelArray array_ = ArrayOf(head_.volume);
  ScratchFolder folder_;
};

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

// NIfTI's own frame is RAS. Read without ITK: bytes 280 to 327 are the rows of the affine.
TEST_F(ReadVolumeTest, NiftisFrameIsTurnedToLps) {
  WriteItk(folder_ / "a.nii", array_, *itk::NiftiImageIO::New());
  const std::string bytes = ReadFileBytes(folder_ / "a.nii");
  std::array<float, 12> rows;
  std::memcpy(rows.data(), bytes.data() + 280, sizeof rows);
  const Vec3 ras(rows[3], rows[7], rows[11]);
  EXPECT_LT((Read("a.nii").volume.origin - Vec3(-ras.x(), -ras.y(), ras.z())).norm(), 1e-3);
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

// ITK makes floats of these: twice the bytes that are in the file.
TEST_F(ReadVolumeTest, ANiftiWithSlopeAndInterceptIsWhole) {
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

TEST_F(ReadVolumeTest, GzipOfSeveralMembersOrPaddedIsReadAndNothingThatIsCut) {
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

TEST_F(ReadVolumeTest, EverySpaceOfAnNrrdIsTurnedToLps) {
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

TEST_F(ReadVolumeTest, SpacesThatSayNothingOfTheHeadAreTold) {
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

TEST_F(ReadVolumeTest, DicomIsSortedBySpaceAndDecompressed) {
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

TEST_F(ReadVolumeTest, DicomOfSagittalSlicesAndInFoldersOfFoldersIsRead) {
  WriteDicom(folder_ / "disc/PA0/SE0", SagittalArrayOf(head_.volume));
  ExpectTheHead(Read("disc"));
}

TEST_F(ReadVolumeTest, SlopeAndInterceptMakeHounsfieldUnits) {
  WriteDicom(folder_ / "ct", array_, {.slope = 2, .intercept = -1024});
  const CtVolume read = Read("ct").volume;
  ASSERT_EQ(read.values.size(), head_.volume.values.size());
  for (std::size_t n = 0; n < read.values.size(); ++n) {
    ASSERT_LE(std::abs(read.values[n] - head_.volume.values[n]), 2) << n;
  }
}

// A turned head in the scanner: the slices' axes are not those of the head.
TEST_F(ReadVolumeTest, DirectionCosinesPlaceTheSkull) {
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

TEST_F(ReadVolumeTest, ATiltedGantryPlacesTheSkull) {
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

TEST_F(ReadVolumeTest, MissingAndDoubledSlicesAreToldOrFilled) {
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

TEST_F(ReadVolumeTest, OfSeveralSeriesOneIsChosen) {
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

TEST_F(ReadVolumeTest, OfAnMrTheSkinIsTaken) {
  VoxelArray mr = array_;
  for (std::int16_t& value : mr.values) {  // bone dark, tissue bright, some noise in the air
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

TEST_F(ReadVolumeTest, ANiftiWhoseVoxelsLieNowhereIsRefusedAtOnce) {
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
        EXPECT_THAT(Words(name), HasSubstr("numbers that say how its voxels lie"));
      }
    }
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

// GDCM ends its process at some of these, or asks for 4 GB.
TEST_F(ReadVolumeTest, DamagedSlicesAreOneClearError) {
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

TEST_F(ReadVolumeTest, EncodedSlicesAreReadBack) {
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
}  // namespace semblance
