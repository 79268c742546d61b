// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/manifest.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>

#include "surfaces/base/atomic_file.h"

namespace semblance {
namespace {

std::string Hex(const unsigned char* bytes, unsigned int count) {
  std::string text;
  for (unsigned int i = 0; i < count; ++i) {
    text += fmt::format("{:02x}", bytes[i]);
  }
  return text;
}

}  // namespace

std::string Sha256OfText(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int length = 0;
  EVP_Digest(text.data(), text.size(), digest.data(), &length, EVP_sha256(), nullptr);
  return Hex(digest.data(), length);
}

std::string Sha256OfFile(const std::filesystem::path& path) {
  return Sha256OfText(ReadFileBytes(path));
}

std::vector<std::pair<std::string, std::string>> LibraryVersions() {
  return {{"ceres", SEMBLANCE_CERES_VERSION},
          {"eigen", SEMBLANCE_EIGEN_VERSION},
          {"cgal", SEMBLANCE_CGAL_VERSION},
          {"compiler", "g++ " __VERSION__}};
}

}  // namespace semblance
