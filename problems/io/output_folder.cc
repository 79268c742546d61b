// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

std::string Reason(int error_number) { return std::generic_category().message(error_number); }

void CreateFolders(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one",
                              folder.string(),
                              error ? error.message() : std::string("a file of this name exists")));
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
  const fs::path probe = folder / fmt::format(".semblance-probe.{}-0.tmp", ::getpid());
  const int descriptor = ::open(probe.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) {
    throw IoError(fmt::format(
        "{}: the output folder cannot be written to: {}; change its permissions or choose another "
        "folder",
        folder.string(), Reason(errno)));
  }
  ::close(descriptor);
  ::unlink(probe.c_str());
}

bool StaysInside(const fs::path& name) {
  const fs::path normal = name.lexically_normal();
  return !normal.empty() && normal.is_relative() && *normal.begin() != ".." &&
         normal.has_filename() && normal != ".";
}

}  // namespace

OutputFolder::OutputFolder(fs::path root, WhenNotEmpty when_not_empty) : root_(std::move(root)) {
  CreateFolders(root_);
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
  const fs::path path = root_ / name;
  CreateFolders(path.parent_path());
  return path;
}

void OutputFolder::Write(std::string_view name, std::string_view bytes, Durability durability) {
  const fs::path path = MakePath(name);
  if (path.parent_path() != root_) {
    SweepTemporaryFiles(path.parent_path());
  }
  WriteFileAtomically(path, bytes, durability);
  written_.emplace_back(name);
}

std::string PlainName(const std::filesystem::path& path) {
  const std::filesystem::path plain = std::filesystem::absolute(path / "").lexically_normal();
  const std::string name = plain.parent_path().filename().string();
  return name.substr(0, name.find('.', 1));
}

}  // namespace semblance::problems
