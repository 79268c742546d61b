// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/encoding.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::surfaces {
namespace {

constexpr std::string_view kBase64Digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// OpenSSL counts bytes with an int. Groups of 3 bytes make 4 digits without padding.
constexpr std::size_t kBase64Block = std::size_t{3} << 28;

std::size_t Padding(std::string_view text) {
  return text.ends_with("==") ? 2 : text.ends_with('=') ? 1 : 0;
}

const unsigned char* AsUnsigned(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

unsigned char* AsUnsigned(char* text) { return reinterpret_cast<unsigned char*>(text); }

EVP_MD_CTX* AsDigest(const auto& state) { return static_cast<EVP_MD_CTX*>(state.get()); }

constexpr std::size_t kGzipBlock = 1 << 16;

[[noreturn]] void ThrowNotWhole(const std::string& name, const char* words) {
  throw IoError(fmt::format("{}: the file is cut short or damaged ({}); copy or export it again",
                            name, words));
}

// Unpacks the consecutive members of a gzip stream.
class Members {
 public:
  // more: returns the next packed bytes, or none at the end. They must stay valid until its next
  // call.
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
    std::array<char, kGzipBlock> block;
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
  bool between_ = false;  // true at a boundary between two members
};

}  // namespace

std::string Base64(std::string_view bytes) {
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');  // OpenSSL adds a final zero
  for (std::size_t at = 0; at < bytes.size(); at += kBase64Block) {
    const std::string_view block = bytes.substr(at, kBase64Block);
    EVP_EncodeBlock(AsUnsigned(text.data() + at / 3 * 4), AsUnsigned(block),
                    static_cast<int>(block.size()));
  }
  text.pop_back();
  return text;
}

std::string FromBase64(std::string_view text) {
  if (text.size() % 4 != 0) {
    throw InputError(fmt::format("Base64: {} characters are not a multiple of 4", text.size()));
  }
  // OpenSSL would skip blanks around the text and accept '=' anywhere.
  const std::string_view digits = text.substr(0, text.size() - Padding(text));
  if (const auto bad = digits.find_first_not_of(kBase64Digits); bad != digits.npos) {
    throw InputError(fmt::format("Base64: character {} is not one of its digits", bad + 1));
  }
  constexpr std::size_t kBlock = kBase64Block / 3 * 4;
  std::string bytes(text.size() / 4 * 3, '\0');
  for (std::size_t at = 0; at < text.size(); at += kBlock) {
    const std::string_view block = text.substr(at, kBlock);
    EVP_DecodeBlock(AsUnsigned(bytes.data() + at / 4 * 3), AsUnsigned(block),
                    static_cast<int>(block.size()));
  }
  bytes.resize(bytes.size() - Padding(text));
  return bytes;
}

Sha256::Sha256() : state_(EVP_MD_CTX_new()) {
  EVP_DigestInit_ex(AsDigest(state_), EVP_sha256(), nullptr);
}

void Sha256::Free::operator()(void* state) const {
  EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(state));
}

void Sha256::Add(std::string_view bytes) {
  EVP_DigestUpdate(AsDigest(state_), bytes.data(), bytes.size());
}

std::string Sha256::Hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int length = 0;
  EVP_DigestFinal_ex(AsDigest(state_), digest.data(), &length);
  std::string text;
  for (unsigned int i = 0; i < length; ++i) {
    text += fmt::format("{:02x}", digest[i]);
  }
  return text;
}

std::string Sha256OfText(std::string_view text) {
  Sha256 sha;
  sha.Add(text);
  return sha.Hex();
}

std::string Sha256OfFile(const std::filesystem::path& path) {
  return Sha256OfText(ReadFileBytes(path));
}

bool IsGzip(const std::filesystem::path& file) {
  std::array<char, 2> head{};
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), head.size());
  return in && head == std::array{'\x1f', '\x8b'};
}

void Unpack(const std::filesystem::path& file,
            const std::function<bool(std::string_view block)>& take) {
  std::ifstream in(file, std::ios::binary);
  const auto packed = std::make_unique<std::array<char, kGzipBlock>>();
  const auto more = [&]() -> std::string_view {
    in.read(packed->data(), packed->size());
    return {packed->data(), static_cast<std::size_t>(in.gcount())};
  };
  Members(more, file.string()).ForEachBlock(take);
}

std::string Unpacked(std::string_view bytes, const std::string& name) {
  const auto more = [&] {
    const std::string_view next = bytes.substr(0, kGzipBlock);
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

}  // namespace semblance::surfaces
