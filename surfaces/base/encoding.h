// SPDX-License-Identifier: GPL-3.0-or-later
// Bytes in other forms: Base64 text, SHA-256 digests, and gzip.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// Encodes bytes as Base64 with padding (RFC 4648), for JSON, XML and HTML.
std::string Base64(std::string_view bytes);

// Decodes the output of Base64. Throws InputError if the text is not Base64 with padding.
std::string FromBase64(std::string_view text);

// Computes the SHA-256 digest of bytes that arrive in pieces.
class Sha256 {
 public:
  Sha256();
  void Add(std::string_view bytes);
  // Returns the digest as 64 lower-case hexadecimal digits. Call it once, after the last Add.
  std::string Hex();

 private:
  struct Free {
    void operator()(void* state) const;
  };
  std::unique_ptr<void, Free> state_;
};

// Returns the SHA-256 of a text, or of a file's bytes, as 64 lower-case hexadecimal digits.
// Sha256OfFile throws IoError if the file cannot be read.
std::string Sha256OfText(std::string_view text);
std::string Sha256OfFile(const std::filesystem::path& path);

// Tests the first two bytes of the file for gzip's mark.
bool IsGzip(const std::filesystem::path& file);

// Unpacks a gzip file and passes the bytes to `take`, block by block, until `take` returns false.
// Only one block is in memory at a time. Consecutive members form one stream, and bytes behind the
// last member are ignored, as gzip does. Throws IoError, with the file's name, if the file ends
// within a member or is damaged. The checksum and length of each fully read member are verified.
void Unpack(const std::filesystem::path& file,
            const std::function<bool(std::string_view block)>& take);

// Unpacks bytes in memory in the same way. name: the source, for error messages.
std::string Unpacked(std::string_view bytes, const std::string& name);

// Appends an integer to `bytes`, lowest byte first on every machine.
template <std::integral Integer>
void AppendLittleEndian(std::string& bytes, Integer value) {
  for (std::size_t k = 0; k < sizeof(Integer); ++k) {
    bytes += static_cast<char>(value >> (8 * k) & 0xFF);
  }
}

// Appends the bytes of a number as they are in memory; a machine that stores the highest byte first
// is refused at compile time.
template <class T>
void AppendRaw(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace semblance::surfaces
