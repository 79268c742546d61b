// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/file_hashes.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

TEST(FileHashes, FollowChangesOfTheFile) {
  const testing::ScratchFolder folder;
  const auto file = folder / "skull.ply";
  FileHashes hashes;
  EXPECT_THROW(hashes.Of(file), IoError);
  for (const char* text : {"one", "two", "three"}) {
    WriteFileAtomically(file, text);
    // The clock of a file system may be coarse, so each version gets a different time.
    std::filesystem::last_write_time(
        file, std::filesystem::file_time_type::clock::now() + std::chrono::hours(text[1]));
    for (int times = 0; times < 2; ++times) {
      EXPECT_EQ(hashes.Of(file), Sha256OfText(text));
    }
  }
}

// A file of the same size and date is another file.
TEST(FileHashes, NoticeAChangeThatKeepsSizeAndTime) {
  const testing::ScratchFolder folder;
  const auto file = folder / "skull.ply";
  WriteFileAtomically(file, "one");
  const auto changed = std::filesystem::last_write_time(file);
  FileHashes hashes;
  EXPECT_EQ(hashes.Of(file), Sha256OfText("one"));
  std::ofstream(file) << "two";
  std::filesystem::last_write_time(file, changed);
  EXPECT_EQ(hashes.Of(file), Sha256OfText("two"));
}

TEST(FileHashes, AnOldFileIsReadOnce) {
  FileHashes hashes;
  for (int times = 0; times < 3; ++times) {
    EXPECT_EQ(hashes.Of("/proc/self/exe").size(), 64U);
  }
  EXPECT_EQ(hashes.read(), 1);
}

}  // namespace
}  // namespace semblance::problems
