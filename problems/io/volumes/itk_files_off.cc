// SPDX-License-Identifier: GPL-3.0-or-later
// Replaces itk_files.cc if ITK is not installed: every function throws.
#include <fmt/format.h>

#include "problems/io/volumes/itk_files.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

[[noreturn]] void ThrowNoItk(const std::string& what) {
  throw IoError(fmt::format(
      "{}: this program was built without ITK, and so cannot read or write DICOM, NRRD or "
      "MetaImage, or write NIfTI; install libinsighttoolkit5-dev and build again",
      what));
}

}  // namespace

VoxelArray ReadImageVolume(const std::filesystem::path& file, VolumeFormat) {
  ThrowNoItk(file.string());
}

std::vector<DicomHeader> ScanDicom(const std::filesystem::path& file) {
  ThrowNoItk(file.parent_path().string());
}

VoxelArray ReadDicomSlices(std::span<const DicomHeader> slices,
                           const std::function<void(const std::string&)>&) {
  ThrowNoItk(slices.empty() ? "DICOM" : slices.front().file.string());
}

void WriteImageVolume(const CtVolume&, const std::filesystem::path& file, VolumeFormat) {
  ThrowNoItk(file.string());
}

std::string EncodeDicomSlice(const CtVolume&, int, const DicomSeriesNames&) {
  ThrowNoItk("DICOM files");
}

}  // namespace semblance::problems
