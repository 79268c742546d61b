// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/manifest.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>

#include "surfaces/base/atomic_file.h"

namespace semblance {
namespace {

std::string HexOf(const unsigned char* bytes, unsigned int count) {
  std::string text;
  for (unsigned int i = 0; i < count; ++i) {
    text += fmt::format("{:02x}", bytes[i]);
  }
  return text;
}

}  // namespace

Sha256::Sha256() : state_(EVP_MD_CTX_new()) {
  EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(state_.get()), EVP_sha256(), nullptr);
}

void Sha256::Free::operator()(void* state) const {
  EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(state));
}

void Sha256::Add(std::string_view bytes) {
  EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(state_.get()), bytes.data(), bytes.size());
}

std::string Sha256::Hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned int length = 0;
  EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(state_.get()), digest.data(), &length);
  return HexOf(digest.data(), length);
}

std::string Sha256OfText(std::string_view text) {
  Sha256 sha;
  sha.Add(text);
  return sha.Hex();
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
