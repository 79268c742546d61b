// SPDX-License-Identifier: GPL-3.0-or-later
// NIfTI, packed and plain.
#include "problems/volumes/read_volume.h"

#include <Eigen/Dense>  // before ITK, which else brings a part of an older one

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <itkNiftiImageIO.h>

#include <array>
#include <cstring>
#include <limits>
#include <string>

#include "tests/testing/volume_files.h"

namespace semblance {
namespace {

using testing::BytesOf;
using testing::Gzipped;
using ::testing::HasSubstr;
using testing::PutAt;
using testing::WriteItk;
using ReadNiftiTest = testing::VolumeFilesTest;

// NIfTI's own frame is RAS. Read without ITK: bytes 280 to 327 are the rows of the affine.
TEST_F(ReadNiftiTest, NiftisFrameIsTurnedToLps) {
  WriteItk(folder_ / "a.nii", array_, *itk::NiftiImageIO::New());
  const std::string bytes = ReadFileBytes(folder_ / "a.nii");
  std::array<float, 12> rows;
  std::memcpy(rows.data(), bytes.data() + 280, sizeof rows);
  const Vec3 ras(rows[3], rows[7], rows[11]);
  EXPECT_LT((Read("a.nii").volume.origin - Vec3(-ras.x(), -ras.y(), ras.z())).norm(), 1e-3);
}

// ITK makes floats of these: twice the bytes that are in the file.
TEST_F(ReadNiftiTest, ANiftiWithSlopeAndInterceptIsWhole) {
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

TEST_F(ReadNiftiTest, GzipOfSeveralMembersOrPaddedIsReadAndNothingThatIsCut) {
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

TEST_F(ReadNiftiTest, ANiftiWhoseVoxelsLieNowhereIsRefusedAtOnce) {
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

}  // namespace
}  // namespace semblance
