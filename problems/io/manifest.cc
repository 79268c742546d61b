// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/manifest.h"

#include <dlfcn.h>

#include <filesystem>

#include "surfaces/base/encoding.h"

namespace semblance::problems {
namespace {

// The name that the loader has for the program itself may be relative to a former folder, so a
// shared object alone is taken by its name.
std::filesystem::path FileWithThisCode() {
  Dl_info info{};
  const bool is_found =
      ::dladdr(reinterpret_cast<const void*>(&LibraryVersions), &info) != 0 && info.dli_fname;
  const std::filesystem::path file = is_found ? info.dli_fname : "";
  return file.filename().string().find(".so") != std::string::npos ? file : "/proc/self/exe";
}

}  // namespace

std::vector<std::pair<std::string, std::string>> LibraryVersions() {
  return {{"ceres", SEMBLANCE_CERES_VERSION},
          {"eigen", SEMBLANCE_EIGEN_VERSION},
          {"cgal", SEMBLANCE_CGAL_VERSION},
          {"compiler", "g++ " __VERSION__}};
}

const std::string& ProgramHash() {
  static const std::string hash = Sha256OfFile(FileWithThisCode());
  return hash;
}

}  // namespace semblance::problems
