// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/invesalius.h"

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

namespace semblance {
namespace {

constexpr int kMostVoxelsASide = 4096;
constexpr std::size_t kMostPlistBytes = 1 << 20;

struct ArchiveCloser {
  void operator()(archive* a) const { archive_read_free(a); }
};
using Archive = std::unique_ptr<archive, ArchiveCloser>;

[[noreturn]] void ThrowNoProject(const std::string& name, archive* a) {
  throw IoError(
      fmt::format("{}: it is no InVesalius project (a tar, gzipped or not), or is cut short: {}",
                  name, archive_error_string(a) ? archive_error_string(a) : "unknown format"));
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
    ThrowNoProject(name, a.get());
  }
  return a;
}

// most: bytes that are wanted; of more, one more is read, and the rest is not looked at.
std::string ReadData(archive* a, const std::string& name, std::size_t most) {
  std::string bytes;
  std::array<char, 1 << 16> block;
  for (;;) {
    const la_ssize_t got = archive_read_data(a, block.data(), block.size());
    if (got < 0) {
      ThrowNoProject(name, a);
    }
    if (got == 0) {
      return bytes;
    }
    bytes.append(block.data(), static_cast<std::size_t>(got));
    if (bytes.size() > most) {
      bytes.resize(most + 1);
      return bytes;
    }
  }
}

// The bytes of the first entry with this file name, whatever its folder, as ReadData gives them.
std::string ReadEntry(const std::string& name, const std::string& wanted, std::size_t most) {
  const Archive a = OpenArchive(name);
  archive_entry* entry = nullptr;
  for (;;) {
    const int status = archive_read_next_header(a.get(), &entry);
    if (status == ARCHIVE_EOF) {
      throw IoError(fmt::format("{}: the project has no entry '{}'", name, wanted));
    }
    if (status != ARCHIVE_OK && status != ARCHIVE_WARN) {
      ThrowNoProject(name, a.get());
    }
    const char* path = archive_entry_pathname(entry);
    if (path && std::filesystem::path(path).filename() == wanted) {
      return ReadData(a.get(), name, most);
    }
  }
}

// The node that follows <key>key</key> in a dict of a property list.
pugi::xml_node ValueOf(const pugi::xml_node& dict, const char* key, const std::string& name) {
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

struct Header {
  std::string matrix_file;
  CtVolume volume;  // no values yet
};

Header ParseHeader(const std::string& plist, const std::string& name) {
  pugi::xml_document document;
  if (!document.load_buffer(plist.data(), plist.size())) {
    throw IoError(fmt::format("{}: main.plist is not a property list", name));
  }
  const pugi::xml_node dict = document.child("plist").child("dict");
  const pugi::xml_node matrix = ValueOf(dict, "matrix", name);
  const std::string type = ValueOf(matrix, "dtype", name).text().as_string();
  if (type != "int16") {
    throw InputError(fmt::format("{}: the matrix is of type '{}'; only int16 is read", name, type));
  }
  // 1 is axial; the frame of ReadInvesalius holds for no other.
  const int orientation = ValueOf(dict, "orientation", name).text().as_int(-1);
  if (orientation != 1) {
    throw InputError(fmt::format("{}: slices of orientation {} are not read; only 1 (axial) is",
                                 name, orientation));
  }
  const auto shape = ThreeNumbers(ValueOf(matrix, "shape", name), "shape", name);
  for (const double n : shape) {
    if (!(n >= 2 && n <= kMostVoxelsASide) || n != std::floor(n)) {
      throw InputError(fmt::format("{}: a shape of {} voxels is not usable; each side is 2 to {}",
                                   name, fmt::join(shape, " x "), kMostVoxelsASide));
    }
  }
  const auto spacing = ThreeNumbers(ValueOf(dict, "spacing", name), "spacing", name);
  Header header;
  header.matrix_file = ValueOf(matrix, "filename", name).text().as_string();
  header.volume.slices = static_cast<int>(shape[0]);
  header.volume.rows = static_cast<int>(shape[1]);
  header.volume.columns = static_cast<int>(shape[2]);
  header.volume.spacing_mm = Vec3(spacing[0], spacing[1], spacing[2]);
  return header;
}

}  // namespace

CtVolume ReadInvesalius(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::string plist = ReadEntry(name, "main.plist", kMostPlistBytes);
  if (plist.size() > kMostPlistBytes) {
    throw InputError(fmt::format("{}: main.plist is larger than {} bytes", name, kMostPlistBytes));
  }
  Header header = ParseHeader(plist, name);
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
  static_assert(std::endian::native == std::endian::little);  // as the file is
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

}  // namespace semblance
