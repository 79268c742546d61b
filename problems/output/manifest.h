// SPDX-License-Identifier: GPL-3.0-or-later
// Which bytes went in and which came out.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace semblance {

// The SHA-256 of bytes that come in pieces.
class Sha256 {
 public:
  Sha256();
  void Add(std::string_view bytes);
  std::string Hex();  // lower-case; once, at the end

 private:
  struct Free {
    void operator()(void* state) const;
  };
  std::unique_ptr<void, Free> state_;
};

// Lower-case hexadecimal SHA-256 of a text, or of a file's bytes (IoError if it cannot be read).
std::string Sha256OfText(std::string_view text);
std::string Sha256OfFile(const std::filesystem::path& path);

// Name and version of each library that has a part in a result, and of the compiler.
std::vector<std::pair<std::string, std::string>> LibraryVersions();

}  // namespace semblance
