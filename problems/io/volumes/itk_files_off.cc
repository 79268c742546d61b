// SPDX-License-Identifier: GPL-3.0-or-later
// Replaces itk_files.cc if ITK is not installed: every function throws.
#include <fmt/format.h>

#include "problems/io/volumes/itk_files.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

[[noreturn]] void ThrowNoItk(const std::string& what) {
  throw IoError(fmt::format(
      "{}: this program was built without ITK, and so cannot read or write DICOM, NIfTI, NRRD or "
      "MetaImage; install libinsighttoolkit5-dev and build again",
      what));
}

}  // namespace

VoxelArray ReadImageVolume(const std::filesystem::path& file, VolumeFormat) {
  ThrowNoItk(file.string());
}

std::vector<DicomHeader> ScanDicom(const std::vector<std::filesystem::path>& files) {
  ThrowNoItk(files.empty() ? "DICOM" : files.front().parent_path().string());
}

void AppendDicomSlice(const DicomHeader& header, VoxelArray&) { ThrowNoItk(header.file.string()); }

void WriteImageVolume(const CtVolume&, const std::filesystem::path& file, VolumeFormat) {
  ThrowNoItk(file.string());
}

std::string EncodeDicomSlice(const CtVolume&, int, const DicomSeriesNames&) {
  ThrowNoItk("DICOM files");
}

}  // namespace semblance::problems
