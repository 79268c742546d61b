// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/output_folder.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

void RefuseLink(const fs::path& folder) {
  std::error_code ignored;
  if (fs::is_symlink(folder, ignored)) {
    throw IoError(fmt::format(
        "{}: it is a link, and files are written only into the output folder itself; replace the "
        "link by a folder, or choose another output folder",
        folder.string()));
  }
}

void RefuseIfNotEmpty(const fs::path& folder) {
  std::error_code error;
  const bool is_empty = fs::is_empty(folder, error);
  if (error) {
    throw IoError(fmt::format("{}: the folder cannot be read: {}; choose another one",
                              folder.string(), error.message()));
  }
  if (fs::exists(folder / kUnfinishedPart, error)) {
    throw IoError(fmt::format(
        "{}: the output folder is unfinished: its writing was cut short (killed, or the disk was "
        "full), and some of its files are the old ones or are missing; add --force to write them "
        "again, or choose another folder",
        folder.string()));
  }
  if (!is_empty) {
    throw IoError(fmt::format(
        "{}: the output folder exists and is not empty, and nothing is overwritten unless asked; "
        "choose another folder, or add --force to replace files in it",
        folder.string()));
  }
}

void TestWriting(const fs::path& folder) {
  if (const std::string reason = FindWritingFault(folder); !reason.empty()) {
    throw IoError(fmt::format(
        "{}: the output folder cannot be written to: {}; change its permissions or choose another "
        "folder",
        folder.string(), reason));
  }
}

bool StaysInside(const fs::path& name) {
  const fs::path normal = name.lexically_normal();
  return !normal.empty() && normal.is_relative() && *normal.begin() != ".." &&
         normal.has_filename() && normal != ".";
}

}  // namespace

OutputFolder::OutputFolder(fs::path root, WhenNotEmpty when_not_empty) : root_(std::move(root)) {
  NewFolders(root_).Keep();
  if (when_not_empty == WhenNotEmpty::kRefuse) {
    RefuseIfNotEmpty(root_);
  }
  TestWriting(root_);
  SweepTemporaryFiles(root_);
}

fs::path OutputFolder::MakePath(std::string_view name) const {
  if (!StaysInside(name)) {
    throw InputError(fmt::format(
        "'{}': not a file name inside the output folder {}; give a relative path without '..'",
        name, root_.string()));
  }
  MakeFolderBelow(root_, fs::path(name).parent_path());
  return root_ / name;
}

void OutputFolder::Write(std::string_view name, std::string_view bytes, Durability durability) {
  const fs::path path = MakePath(name);
  if (path.parent_path() != root_) {
    SweepTemporaryFiles(path.parent_path());
  }
  WriteFileAtomically(path, bytes, durability);
  written_.emplace_back(name);
}

void RefuseLinksBelow(const fs::path& root, const fs::path& name) {
  fs::path folder = root;
  for (const fs::path& part : name.lexically_normal()) {
    folder /= part;
    RefuseLink(folder);
  }
}

fs::path MakeFolderBelow(const fs::path& root, const fs::path& name) {
  RefuseLinksBelow(root, name);
  NewFolders(root / name).Keep();
  return root / name;
}

std::string PlainName(const std::filesystem::path& path) {
  const std::filesystem::path plain = std::filesystem::absolute(path / "").lexically_normal();
  const std::string name = plain.parent_path().filename().string();
  return name.substr(0, name.find('.', 1));
}

}  // namespace semblance::problems
