// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the readers of volumes: a volume that is read is sound, anything else is one of our
// errors, also where ITK or GDCM, which come as they are installed, end the process that reads it.
// The first byte tells the kind: n NIfTI, z NIfTI gzipped, r NRRD, m MetaImage, d a DICOM slice,
// which with copies of it makes a series.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "problems/volumes/read_volume.h"
#include "surfaces/base/error.h"

namespace {

namespace fs = std::filesystem;

// On a disk in memory where there is one; gone at the end.
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

// As many as a series must have.
constexpr int kSlices = 8;

// The slice that lies 2 mm times `slice` higher, where the text of the first one's position is
// found.
std::string SliceAt(std::string bytes, int slice) {
  const std::string place = "0\\0\\0 ";
  if (const std::size_t at = bytes.find(place); at != std::string::npos) {
    std::string other = "0\\0\\" + std::to_string(2 * slice);
    other.resize(place.size(), ' ');
    bytes.replace(at, place.size(), other);
  }
  return bytes;
}

fs::path Laid(const Scratch& scratch, char kind, const std::string& bytes) {
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
    const fs::path path = Laid(scratch, static_cast<char>(data[0]), bytes);
    semblance::CheckVolume(semblance::ReadVolume(path, {}, {}).volume, "fuzz");
  } catch (const semblance::Error&) {
  }
  return 0;
}
