// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/gzip_bytes.h"

#include <archive.h>
#include <archive_entry.h>
#include <fmt/format.h>

#include <array>
#include <fstream>
#include <memory>
#include <string>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

[[noreturn]] void ThrowNotWhole(const std::filesystem::path& file, archive* a) {
  const char* const words = archive_error_string(a);
  throw IoError(fmt::format("{}: the file is cut short or damaged ({}); copy or export it again",
                            file.string(), words ? words : "it cannot be unpacked"));
}

}  // namespace

bool IsGzip(const std::filesystem::path& file) {
  std::array<char, 2> head{};
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head.size());
  return in && head == std::array{'\x1f', '\x8b'};
}

void Unpack(const std::filesystem::path& file,
            const std::function<bool(std::string_view block)>& take) {
  constexpr std::size_t kBlock = 1 << 16;
  const std::unique_ptr<archive, int (*)(archive*)> a(archive_read_new(), archive_read_free);
  archive_read_support_filter_gzip(a.get());
  archive_read_support_format_raw(a.get());
  if (archive_read_open_filename(a.get(), file.string().c_str(), kBlock) != ARCHIVE_OK) {
    ThrowNotWhole(file, a.get());
  }
  archive_entry* entry = nullptr;
  const int status = archive_read_next_header(a.get(), &entry);
  if (status == ARCHIVE_EOF) {
    return;  // nothing was packed
  }
  if (status != ARCHIVE_OK) {
    ThrowNotWhole(file, a.get());
  }
  std::array<char, kBlock> block;
  for (bool goes_on = true; goes_on;) {
    const la_ssize_t got = archive_read_data(a.get(), block.data(), block.size());
    if (got < 0) {
      ThrowNotWhole(file, a.get());
    }
    goes_on = got > 0 && take({block.data(), static_cast<std::size_t>(got)});
  }
}

}  // namespace semblance
