// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/given_files.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <system_error>

#include "problems/io/manifest.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The path without links. A path that cannot be resolved stays as it is.
fs::path Canonical(const fs::path& path) {
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path : resolved;
}

// The place of a file, and the place to which it leads if it is a link.
std::array<fs::path, 2> FilePlaces(const fs::path& file) {
  std::error_code error;
  const fs::path whole = fs::absolute(file, error);
  return {Canonical(whole.parent_path()) / whole.filename(), Canonical(file)};
}

bool IsNoFile(const fs::path& given) { return given.empty() || given == "-"; }

bool IsRegular(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

// Guards against a manifest that was altered.
bool LeadsOut(const fs::path& name) {
  return name.is_absolute() || std::ranges::find(name, fs::path("..")) != name.end();
}

bool HasBytes(const fs::path& file, const std::string& sha256) try {
  return IsRegular(file) && Sha256OfFile(file) == sha256;
} catch (const Error&) {  // a file that cannot be read does not match
  return false;
}

struct ManifestLine {
  std::string file, sha256;
};

std::vector<ManifestLine> ReadManifestLines(const fs::path& manifest) {
  std::ifstream text(manifest);
  const Json json = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || !json.contains("outputs") || !json["outputs"].is_array()) {
    return {};
  }
  std::vector<ManifestLine> lines;
  for (const Json& line : json["outputs"]) {
    const bool is_known = line.is_object() && line.contains("file") && line["file"].is_string() &&
                          line.contains("sha256") && line["sha256"].is_string();
    if (is_known) {
      lines.push_back({line["file"], line["sha256"]});
    }
  }
  return lines;
}

bool HasMark(const fs::path& file, const FileMark& mark) {
  if (!IsRegular(file) || !std::regex_match(file.filename().string(), std::regex(mark.name))) {
    return false;
  }
  std::string head(std::size_t{1} << 16, '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), std::ssize(head));
  return head.find(mark.words) != std::string::npos;
}

}  // namespace

bool IsAmong(std::span<const std::string_view> outputs, std::string_view name) {
  return std::ranges::any_of(outputs, [&](std::string_view output) {
    return ::fnmatch(std::string(output).c_str(), std::string(name).c_str(), 0) == 0;
  });
}

bool IsAnyOf(std::span<const fs::path> given, const fs::path& out) {
  const fs::path replaced = FilePlaces(out)[0];  // writing replaces a link, not its target
  return std::ranges::any_of(given, [&](const fs::path& file) {
    return !IsNoFile(file) && std::ranges::count(FilePlaces(file), replaced) > 0;
  });
}

void RefuseToReplace(const fs::path& out, std::span<const fs::path> given) {
  if (IsAnyOf(given, out)) {
    throw InputError(fmt::format(
        "{}: this file is read, and input files are never replaced; name another output file",
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
    for (const fs::path& place : FilePlaces(file)) {
      const std::string name = place.lexically_relative(root).generic_string();
      if (IsAmong(given.outputs, name)) {
        throw InputError(fmt::format(
            "{}: this file is read, and would be replaced by the {} that is written into {}; input "
            "files are never replaced: give another --out",
            file.string(), name, folder.string()));
      }
    }
  }
}

std::vector<std::string> OldFiles(const fs::path& folder, const GivenFiles& job,
                                  const std::vector<fs::path>& written) {
  const auto may_remove = [&](const fs::path& name) {
    return std::ranges::find(written, name) == written.end() && !IsAnyOf(job.files, folder / name);
  };
  std::vector<std::string> old;
  for (const ManifestLine& line : ReadManifestLines(folder / "manifest.json")) {
    if (IsAmong(job.outputs, line.file) && !LeadsOut(line.file) && may_remove(line.file) &&
        HasBytes(folder / line.file, line.sha256)) {
      old.push_back(line.file);
    }
  }
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const fs::path name = at->path().filename();
    const auto has = [&](const FileMark& mark) { return HasMark(at->path(), mark); };
    if (may_remove(name) && std::ranges::any_of(job.marks, has)) {
      old.push_back(name.string());
    }
  }
  return old;
}

void RemoveFiles(const fs::path& folder, const std::vector<std::string>& names) {
  std::error_code ignored;
  for (const std::string& name : names) {
    fs::remove(folder / name, ignored);
    for (fs::path above = fs::path(name).parent_path(); !above.empty();
         above = above.parent_path()) {
      fs::remove(folder / above, ignored);  // has no effect on a folder that is not empty
    }
  }
}

}  // namespace semblance::problems
