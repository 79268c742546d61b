// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/invesalius.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <pugixml.hpp>
#include <string>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Limits of a damaged or hostile file; real projects are far below them.
constexpr int kMaxVoxelsPerSide = 4096;
constexpr std::size_t kMaxPlist_bytes = 1 << 20;

struct ArchiveCloser {
  void operator()(archive* a) const { archive_read_free(a); }
};
using Archive = std::unique_ptr<archive, ArchiveCloser>;

[[noreturn]] void ThrowNotAProject(const std::string& name, archive* a) {
  throw IoError(fmt::format(
      "{}: it is not an InVesalius project (a tar, gzipped or not), or is cut short: {}", name,
      archive_error_string(a) ? archive_error_string(a) : "unknown format"));
}

Archive OpenArchive(const std::string& name) {
  if (!std::filesystem::is_regular_file(name)) {
    throw IoError(
        fmt::format("{}: {}", name,
                    std::filesystem::exists(name) ? "is a folder, not a file" : "no such file"));
  }
  Archive a(archive_read_new());
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_tar(a.get());
  constexpr std::size_t kArchiveBlock = 1 << 16;
  if (archive_read_open_filename(a.get(), name.c_str(), kArchiveBlock) != ARCHIVE_OK) {
    ThrowNotAProject(name, a.get());
  }
  return a;
}

// Reads at most max_bytes + 1 bytes: the additional byte shows that there are more.
std::string ReadData(archive* a, const std::string& name, std::size_t max_bytes) {
  std::string bytes;
  std::array<char, 1 << 16> block;
  for (;;) {
    const la_ssize_t got = archive_read_data(a, block.data(), block.size());
    if (got < 0) {
      ThrowNotAProject(name, a);
    }
    if (got == 0) {
      return bytes;
    }
    bytes.append(block.data(), static_cast<std::size_t>(got));
    if (bytes.size() > max_bytes) {
      bytes.resize(max_bytes + 1);
      return bytes;
    }
  }
}

// Reads the first entry with this file name in any folder, like ReadData.
std::string ReadEntry(const std::string& name, const std::string& wanted, std::size_t max_bytes) {
  const Archive a = OpenArchive(name);
  archive_entry* entry = nullptr;
  for (;;) {
    const int status = archive_read_next_header(a.get(), &entry);
    if (status == ARCHIVE_EOF) {
      throw IoError(fmt::format("{}: the project has no entry '{}'", name, wanted));
    }
    if (status != ARCHIVE_OK && status != ARCHIVE_WARN) {
      ThrowNotAProject(name, a.get());
    }
    const char* path = archive_entry_pathname(entry);
    if (path && std::filesystem::path(path).filename() == wanted) {
      return ReadData(a.get(), name, max_bytes);
    }
  }
}

// The node that follows <key>key</key> in a dict of a property list.
pugi::xml_node PlistValue(const pugi::xml_node& dict, const char* key, const std::string& name) {
  for (const pugi::xml_node node : dict.children("key")) {
    if (std::strcmp(node.child_value(), key) == 0 && node.next_sibling()) {
      return node.next_sibling();
    }
  }
  throw IoError(fmt::format("{}: main.plist has no '{}'", name, key));
}

std::array<double, 3> ThreeNumbers(const pugi::xml_node& array, const char* key,
                                   const std::string& name) {
  std::array<double, 3> numbers = {kNaN, kNaN, kNaN};
  std::size_t count = 0;
  for (const pugi::xml_node node : array.children()) {
    if (count < 3) {
      numbers[count] = node.text().as_double(kNaN);
    }
    ++count;
  }
  if (count != 3) {
    throw InputError(fmt::format("{}: '{}' has {} numbers; it needs 3", name, key, count));
  }
  return numbers;
}

struct ProjectHeader {
  std::string matrix_file;
  CtVolume volume;  // without values
};

ProjectHeader ParseProjectHeader(const std::string& plist, const std::string& name) {
  pugi::xml_document document;
  if (!document.load_buffer(plist.data(), plist.size())) {
    throw IoError(fmt::format("{}: main.plist is not a property list", name));
  }
  const pugi::xml_node dict = document.child("plist").child("dict");
  const pugi::xml_node matrix = PlistValue(dict, "matrix", name);
  const std::string type = PlistValue(matrix, "dtype", name).text().as_string();
  if (type != "int16") {
    throw InputError(fmt::format("{}: the matrix is of type '{}'; only int16 is read", name, type));
  }
  // 1 is axial. The frame of ReadInvesalius is valid for this orientation only.
  const int orientation = PlistValue(dict, "orientation", name).text().as_int(-1);
  if (orientation != 1) {
    throw InputError(fmt::format("{}: slices of orientation {} are not read; only 1 (axial) is",
                                 name, orientation));
  }
  const auto shape = ThreeNumbers(PlistValue(matrix, "shape", name), "shape", name);
  for (const double n : shape) {
    if (!(n >= 2 && n <= kMaxVoxelsPerSide) || n != std::floor(n)) {
      throw InputError(fmt::format("{}: a shape of {} voxels is not usable; each side is 2 to {}",
                                   name, fmt::join(shape, " x "), kMaxVoxelsPerSide));
    }
  }
  const auto spacing = ThreeNumbers(PlistValue(dict, "spacing", name), "spacing", name);
  ProjectHeader header;
  header.matrix_file = PlistValue(matrix, "filename", name).text().as_string();
  header.volume.slices = static_cast<int>(shape[0]);
  header.volume.rows = static_cast<int>(shape[1]);
  header.volume.columns = static_cast<int>(shape[2]);
  header.volume.spacing_mm = Vec3(spacing[0], spacing[1], spacing[2]);
  return header;
}

}  // namespace

CtVolume ReadInvesalius(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::string plist = ReadEntry(name, "main.plist", kMaxPlist_bytes);
  if (plist.size() > kMaxPlist_bytes) {
    throw InputError(fmt::format("{}: main.plist is larger than {} bytes", name, kMaxPlist_bytes));
  }
  ProjectHeader header = ParseProjectHeader(plist, name);
  CtVolume volume = std::move(header.volume);
  const std::size_t voxels = volume.Index(0, 0, volume.slices);
  CheckVolumeClaim(
      {.counts = {static_cast<double>(volume.columns), static_cast<double>(volume.rows),
                  static_cast<double>(volume.slices)},
       .file_bytes = static_cast<double>(std::filesystem::file_size(path))},
      name);
  const std::size_t needed = voxels * sizeof(std::int16_t);
  const std::string bytes = ReadEntry(name, header.matrix_file, needed);
  if (bytes.size() != needed) {
    throw IoError(fmt::format("{}: '{}' has {} bytes; {} x {} x {} voxels of int16 need {}", name,
                              header.matrix_file,
                              bytes.size() > needed ? fmt::format("more than {}", needed)
                                                    : fmt::format("{}", bytes.size()),
                              volume.slices, volume.rows, volume.columns, needed));
  }
  static_assert(std::endian::native == std::endian::little);  // like the file
  volume.values.resize(voxels);
  const std::size_t row_bytes = volume.columns * sizeof(std::int16_t);
  for (int slice = 0; slice < volume.slices; ++slice) {
    for (int row = 0; row < volume.rows; ++row) {  // the file's rows run from back to front
      std::memcpy(&volume.values[volume.Index(0, row, slice)],
                  &bytes[volume.Index(0, volume.rows - 1 - row, slice) * sizeof(std::int16_t)],
                  row_bytes);
    }
  }
  volume.origin.y() = -volume.spacing_mm.y() * (volume.rows - 1);
  CheckVolume(volume, name);
  return volume;
}

}  // namespace semblance::problems
