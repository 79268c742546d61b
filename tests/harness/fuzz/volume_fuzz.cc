// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the readers of volumes. A volume that is read is valid; any other input is an Error of
// this program, also if ITK or GDCM end the child process that reads it. These two libraries are
// the installed ones, without instrumentation. The first byte selects the format: n NIfTI, z
// gzipped NIfTI, r NRRD, m MetaImage, any other a DICOM slice, which makes a series with copies of
// itself.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "problems/io/volumes/read_volume.h"
#include "surfaces/base/error.h"

namespace {

namespace fs = std::filesystem;

// A folder that is removed at the end, on a disk in memory if there is one.
class Scratch {
 public:
  Scratch() : root_(Place()) { fs::create_directories(root_); }
  ~Scratch() { fs::remove_all(root_); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  fs::path Write(const std::string& name, std::string_view bytes) const {
    const fs::path path = root_ / name;
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }

 private:
  static fs::path Place() {
    const fs::path memory = "/dev/shm";
    const fs::path above = fs::is_directory(memory) ? memory : fs::temp_directory_path();
    return above / ("volume_fuzz_" + std::to_string(::getpid()));
  }
  fs::path root_;
};

// The least number of slices of a head (dicom_series.cc).
constexpr int kSlices = 8;

// A copy of the slice, moved up by 2 mm times `slice` if its position has the expected text.
std::string SliceAt(std::string bytes, int slice) {
  const std::string place = "0\\0\\0 ";
  if (const std::size_t at = bytes.find(place); at != std::string::npos) {
    std::string other = "0\\0\\" + std::to_string(2 * slice);
    other.resize(place.size(), ' ');
    bytes.replace(at, place.size(), other);
  }
  return bytes;
}

fs::path WriteInput(const Scratch& scratch, char kind, const std::string& bytes) {
  switch (kind) {
    case 'n':
      return scratch.Write("a.nii", bytes);
    case 'z':
      return scratch.Write("a.nii.gz", bytes);
    case 'r':
      return scratch.Write("a.nrrd", bytes);
    case 'm':
      return scratch.Write("a.mha", bytes);
    default:
      for (int slice = 1; slice < kSlices; ++slice) {
        scratch.Write("d/" + std::to_string(slice) + ".dcm", SliceAt(bytes, slice));
      }
      return scratch.Write("d/0.dcm", bytes).parent_path();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Scratch scratch;
  if (size < 2) {
    return 0;
  }
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const fs::path path = WriteInput(scratch, static_cast<char>(data[0]), bytes);
    semblance::problems::CheckVolume(semblance::problems::ReadVolume(path, {}, {}).volume, "fuzz");
  } catch (const semblance::problems::Error&) {
  }
  return 0;
}
