// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/gzip_bytes.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <memory>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr std::size_t kBlock = 1 << 16;

[[noreturn]] void ThrowNotWhole(const std::string& name, const char* words) {
  throw IoError(fmt::format("{}: the file is cut short or damaged ({}); copy or export it again",
                            name, words));
}

// The members of a gzip file, packed bytes in and unpacked ones out.
class Members {
 public:
  // more: the next packed bytes, or none at the end; they are to last until the next call.
  Members(std::function<std::string_view()> more, std::string name)
      : more_(std::move(more)), name_(std::move(name)) {
    if (inflateInit2(&stream_, MAX_WBITS + 16) != Z_OK) {  // 16: gzip, with its checksum
      throw IoError(fmt::format("{}: it cannot be unpacked", name_));
    }
  }
  ~Members() { inflateEnd(&stream_); }
  Members(const Members&) = delete;
  Members& operator=(const Members&) = delete;

  void ForEachBlock(const std::function<bool(std::string_view block)>& take) {
    std::array<char, kBlock> block;
    while (IsMemberAhead()) {
      stream_.next_out = reinterpret_cast<Bytef*>(block.data());
      stream_.avail_out = static_cast<uInt>(block.size());
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR) {
        ThrowNotWhole(name_, stream_.msg != nullptr ? stream_.msg : "it cannot be unpacked");
      }
      const std::size_t got = block.size() - stream_.avail_out;
      if (got > 0 && !take({block.data(), got})) {
        return;
      }
      if (status == Z_STREAM_END) {
        between_ = true;
        inflateReset(&stream_);
      }
    }
  }

 private:
  bool HasInput() {
    if (stream_.avail_in == 0) {
      const std::string_view next = more_();
      stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(next.data()));
      stream_.avail_in = static_cast<uInt>(next.size());
    }
    return stream_.avail_in > 0;
  }

  bool IsMemberAhead() {
    constexpr Bytef kMagic = 0x1f;
    if (!HasInput()) {
      if (!between_) {
        ThrowNotWhole(name_, "it ends too early");
      }
      return false;
    }
    return !std::exchange(between_, false) || *stream_.next_in == kMagic;
  }

  std::function<std::string_view()> more_;
  std::string name_;
  z_stream stream_{};
  bool between_ = false;  // members
};

}  // namespace

bool IsGzip(const std::filesystem::path& file) {
  std::array<char, 2> head{};
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head.size());
  return in && head == std::array{'\x1f', '\x8b'};
}

void Unpack(const std::filesystem::path& file,
            const std::function<bool(std::string_view block)>& take) {
  std::ifstream in(file, std::ios::binary);
  const auto packed = std::make_unique<std::array<char, kBlock>>();
  const auto more = [&]() -> std::string_view {
    in.read(packed->data(), packed->size());
    return {packed->data(), static_cast<std::size_t>(in.gcount())};
  };
  Members(more, file.string()).ForEachBlock(take);
}

std::string Unpacked(std::string_view bytes, const std::string& name) {
  const auto more = [&] {
    const std::string_view next = bytes.substr(0, kBlock);
    bytes.remove_prefix(next.size());
    return next;
  };
  std::string unpacked;
  Members(more, name).ForEachBlock([&](std::string_view block) {
    unpacked += block;
    return true;
  });
  return unpacked;
}

}  // namespace semblance
