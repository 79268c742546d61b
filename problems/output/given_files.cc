// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/given_files.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

// As far as it can be told; a name that no system takes stays as it is.
fs::path Canonical(const fs::path& path) {
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path : resolved;
}

// Where a file stands, and, if that is a link, where it leads.
std::array<fs::path, 2> PlacesOf(const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::absolute(file, error);
  return {Canonical(whole.parent_path()) / whole.filename(), Canonical(file)};
}

bool IsNoFile(const fs::path& given) { return given.empty() || given == "-"; }

}  // namespace

bool IsAmong(std::span<const std::string_view> outputs, std::string_view name) {
  return std::ranges::any_of(outputs, [&](std::string_view output) {
    return ::fnmatch(std::string(output).c_str(), std::string(name).c_str(), 0) == 0;
  });
}

bool IsOneOf(std::span<const fs::path> given, const fs::path& out) {
  const fs::path replaced =
      PlacesOf(out)[0];  // a link that is written over leads elsewhere no more
  return std::ranges::any_of(given, [&](const fs::path& file) {
    return !IsNoFile(file) && std::ranges::count(PlacesOf(file), replaced) > 0;
  });
}

void RefuseToReplace(const fs::path& out, std::span<const fs::path> given) {
  if (IsOneOf(given, out)) {
    throw InputError(fmt::format(
        "{}: it is read here, and what is read is never replaced; name another file for what is "
        "written",
        out.string()));
  }
}

void RefuseExisting(const fs::path& out, bool force) {
  if (!force && fs::exists(out)) {
    throw IoError(fmt::format("{}: it exists; name another file, or add --force to replace it",
                              out.string()));
  }
}

void RefuseToReplace(const fs::path& folder, const GivenFiles& given) {
  const fs::path root = Canonical(folder);
  for (const fs::path& file : given.files) {
    if (IsNoFile(file)) {
      continue;
    }
    for (const fs::path& place : PlacesOf(file)) {
      const std::string name = place.lexically_relative(root).generic_string();
      if (IsAmong(given.outputs, name)) {
        throw InputError(fmt::format(
            "{}: it is read here, and would be replaced by the {} that is written into {}; what is "
            "read is never replaced: give another --out",
            file.string(), name, folder.string()));
      }
    }
  }
}

}  // namespace semblance
