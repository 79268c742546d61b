// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/staged_folder.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "problems/output/old_files.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPart = kUnfinishedPart;

// Absolute, without links and without a slash at the end.
fs::path Resolved(const fs::path& root) {
  std::error_code error;
  fs::path path = fs::weakly_canonical(fs::absolute(root, error), error);
  if (error || path.empty()) {
    throw IoError(fmt::format("{}: not the name of a folder: {}; choose another one", root.string(),
                              error.message()));
  }
  return path.has_filename() ? path : path.parent_path();
}

bool OnOneDevice(const fs::path& a, const fs::path& b) {
  struct stat of_a {
  }, of_b{};
  return ::stat(a.c_str(), &of_a) == 0 && ::stat(b.c_str(), &of_b) == 0 &&
         of_a.st_dev == of_b.st_dev;
}

bool Exists(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

// A folder in which nothing is, or only what a killed process has left.
bool HoldsNothing(const fs::path& folder) {
  std::error_code error;
  SweepTemporaryFiles(folder);
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().filename() != kPart) {
      return false;
    }
  }
  return !error;
}

// Whether the folder of a new name can be put beside `root` and be renamed to it.
bool CanBeBeside(const fs::path& root) {
  const fs::path above = root.parent_path();
  if (above == root) {
    return false;
  }
  std::error_code ignored;
  const bool is_current = fs::equivalent(root, fs::current_path(ignored), ignored);
  return !Exists(root) || (HoldsNothing(root) && !Exists(root / kPart) && !is_current &&
                           ::access(above.c_str(), W_OK | X_OK) == 0 && OnOneDevice(root, above));
}

// Throws as OutputFolder does.
void RequireUsable(const fs::path& root, WhenNotEmpty when_not_empty) {
  const OutputFolder tried(root, when_not_empty);
}

// Makes the folders above `folder`; returns those that were not there.
std::vector<fs::path> MakeAbove(const fs::path& folder, const fs::path& said) {
  std::vector<fs::path> missing;
  for (fs::path above = folder.parent_path(); !Exists(above) && above != above.parent_path();
       above = above.parent_path()) {
    missing.insert(missing.begin(), above);
  }
  std::error_code error;
  fs::create_directories(folder.parent_path(), error);
  if (error) {
    throw IoError(fmt::format("{}: the folder cannot be created: {}; choose another one",
                              said.string(), error.message()));
  }
  return missing;
}

// The regular files below `folder`, relative to it: those that `last` names at the end, in its
// order.
std::vector<fs::path> FilesBelow(const fs::path& folder, const std::vector<std::string>& last) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files.push_back(entry.path().lexically_relative(folder));
    }
  }
  const auto rank = [&](const fs::path& file) {
    const auto at = std::find(last.rbegin(), last.rend(), file.generic_string());
    return last.rend() - at;  // 0 for one that is not named
  };
  std::sort(files.begin(), files.end());
  std::stable_sort(files.begin(), files.end(),
                   [&](const fs::path& a, const fs::path& b) { return rank(a) < rank(b); });
  return files;
}

// A name beside `root` that nothing has.
fs::path FreeNameBeside(const fs::path& root) {
  for (int n = 1;; ++n) {
    fs::path name = root;
    name += fmt::format(".kept-{}", n);
    if (!Exists(name)) {
      return name;
    }
  }
}

}  // namespace

StagedFolder::StagedFolder(const fs::path& root, WhenNotEmpty when_not_empty, GivenFiles given)
    : root_(Resolved(root)), when_not_empty_(when_not_empty), given_(std::move(given)) {
  if (Exists(root_)) {
    RequireUsable(root_, HoldsNothing(root_) ? WhenNotEmpty::kReplaceFiles : when_not_empty);
    RefuseToReplace(root, given_);
  }
  beside_ = CanBeBeside(root_);
  made_ = MakeAbove(root_, root);
  try {
    const fs::path beside =
        root_.parent_path() / fmt::format(".{}{}", root_.filename().string(), kPart);
    claim_.Take(beside_ ? beside : root_ / kPart, root.string());
    files_.emplace(claim_.Folder(), WhenNotEmpty::kReplaceFiles);
    if (when_not_empty == WhenNotEmpty::kRefuse && Exists(root_) && !HoldsNothing(root_)) {
      RequireUsable(root_, when_not_empty);  // came up just now, and is refused
    }
  } catch (...) {
    Undo();
    throw;
  }
}

StagedFolder::~StagedFolder() {
  if (!published_) {
    Undo();
  }
}

void StagedFolder::Undo() {
  std::error_code ignored;
  if (files_) {
    fs::remove_all(claim_.Folder(), ignored);
  }
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) {
    fs::remove(*folder, ignored);  // where nobody else has put something
  }
}

// One step, where nothing is in the way.
bool StagedFolder::TakesName() const {
  std::error_code ignored;
  if (const fs::file_status there = fs::status(root_, ignored); fs::exists(there)) {
    fs::permissions(claim_.Folder(), there.permissions(), ignored);
  }
  return std::rename(claim_.Folder().c_str(), root_.c_str()) == 0;
}

void StagedFolder::Publish(Durability durability) {
  const bool is_in_the_way =
      when_not_empty_ == WhenNotEmpty::kRefuse && Exists(root_) && !HoldsNothing(root_);
  if (is_in_the_way) {
    KeepAndFail("another program has written there meanwhile");
  }
  if (!(beside_ && TakesName())) {
    MoveFiles();
  }
  if (durability == Durability::kSynced) {
    SyncFolder(root_.parent_path());
  }
  published_ = true;
  claim_.Release();
}

void StagedFolder::MoveFiles() {
  const fs::path& from = claim_.Folder();
  const std::vector<fs::path> files = FilesBelow(from, files_->Written());
  std::error_code error;
  for (const fs::path& file : files) {
    if (fs::is_directory(root_ / file, error)) {
      KeepAndFail(fmt::format("{} is a folder there", file.string()));
    }
    if (IsOneOf(given_.files, root_ / file)) {
      KeepAndFail(fmt::format("{} is a file that was read", file.string()));
    }
  }
  const std::vector<std::string> old = OldFiles(root_, given_, files);
  if (!files.empty()) {
    fs::remove(root_ / files.back(), error);  // it says that the others are one job's
  }
  for (const fs::path& file : files) {
    fs::create_directories((root_ / file).parent_path(), error);
    fs::rename(from / file, root_ / file, error);
    if (error) {
      KeepAndFail(fmt::format("{}: {}", file.string(), error.message()));
    }
  }
  RemoveFiles(root_, old);
  fs::remove_all(from, error);
}

void StagedFolder::KeepAndFail(const std::string& why) {
  const fs::path kept = FreeNameBeside(root_);
  const bool renamed = std::rename(claim_.Folder().c_str(), kept.c_str()) == 0;
  published_ = true;  // so that it stays
  throw IoError(fmt::format("{}: the files cannot be put there: {}; what is not there is in {}",
                            root_.string(), why, (renamed ? kept : claim_.Folder()).string()));
}

}  // namespace semblance
