// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/disk_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "problems/experiment/skull_stage.h"
#include "problems/io/manifest.h"
#include "problems/subject/phantom.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using testing::ScratchFolder;

constexpr std::uintmax_t kHead = 82;  // bytes of the mark and the hash in each file

std::string Key(int n) { return Sha256OfText(std::to_string(n)); }

void Age(const fs::path& folder, int n, int hours) {
  const fs::path file = folder / (Key(n) + ".bin");
  fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(hours));
}

TEST(DiskCache, ReturnsStoredValuesAndNothingElse) {
  const ScratchFolder folder;
  const DiskCache cache(folder / "cache", 1 << 20);
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
  cache.Put(Key(1), std::string("a\0b", 3));
  cache.Put(Key(2), "");
  EXPECT_EQ(cache.Get(Key(1)), std::string("a\0b", 3));
  EXPECT_EQ(cache.Get(Key(2)), "");
  EXPECT_EQ(cache.Get(Key(3)), std::nullopt);
}

TEST(DiskCache, AFileInsteadOfAFolderIsAnError) {
  const ScratchFolder folder;
  WriteFileAtomically(folder / "mine", "a");
  for (const char* wrong : {"mine", "mine/cache"}) {
    EXPECT_THROW(DiskCache(folder / wrong, 1 << 20), IoError) << wrong;
  }
  EXPECT_EQ(ReadFileBytes(folder / "mine"), "a");
}

TEST(DiskCache, ADamagedValueCountsAsMissing) {
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 1 << 20);
  cache.Put(Key(1), "some bytes");
  const fs::path file = folder / (Key(1) + ".bin");
  std::string bytes = ReadFileBytes(file);
  bytes.back() ^= 1;
  WriteFileAtomically(file, bytes);
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
  WriteFileAtomically(file, "x");
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
}

// A hash of the content alone would take the value of another key.
TEST(DiskCache, ExchangedFilesCountAsMissing) {
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 1 << 20);
  const fs::path a = folder / (Key(1) + ".bin"), b = folder / (Key(2) + ".bin");
  cache.Put(Key(1), "one");
  cache.Put(Key(2), "two");
  fs::rename(a, folder / "x");
  fs::rename(b, a);
  fs::rename(folder / "x", b);
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
  EXPECT_EQ(cache.Get(Key(2)), std::nullopt);
  cache.Put(Key(1), "one");
  EXPECT_EQ(cache.Get(Key(1)), "one");
}

TEST(DiskCache, LinksAndPipesAreNotRead) {
  const ScratchFolder folder;
  const DiskCache cache(folder / "cache", 1 << 20);
  cache.Put(Key(1), "one");
  const fs::path file = folder / "cache" / (Key(1) + ".bin");
  fs::rename(file, folder / "elsewhere");
  fs::create_symlink(folder / "elsewhere", file);
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
  fs::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
}

// Only root can give files to others.
TEST(DiskCache, InASharedFolderFilesOfOtherPeopleCountAsMissing) {
  if (::geteuid() != 0) {
    GTEST_SKIP() << "the test changes owners, which only root may do";
  }
  constexpr uid_t kFolderOwner = 12345, kOther = 12346;
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 1 << 20);
  cache.Put(Key(1), "one");
  const fs::path file = folder / (Key(1) + ".bin");
  ASSERT_EQ(::chown(folder.Path().c_str(), kFolderOwner, 0), 0);
  ASSERT_EQ(::chown(file.c_str(), kFolderOwner, 0), 0);
  EXPECT_EQ(cache.Get(Key(1)), "one");
  ASSERT_EQ(::chown(file.c_str(), kOther, 0), 0);
  EXPECT_EQ(cache.Get(Key(1)), std::nullopt);
  cache.Put(Key(1), "one");
  EXPECT_EQ(cache.Get(Key(1)), "one") << "computed and stored again";
}

TEST(DiskCache, AboveTheLimitTheLeastRecentlyUsedIsDeleted) {
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 3 * (kHead + 100) + 10);
  for (int n = 1; n <= 3; ++n) {
    cache.Put(Key(n), std::string(100, 'x'));
    Age(folder.Path(), n, 10 - n);
  }
  EXPECT_TRUE(cache.Get(Key(1)));  // now the most recently used
  cache.Put(Key(4), std::string(100, 'x'));
  EXPECT_TRUE(cache.Get(Key(1)));
  EXPECT_FALSE(cache.Get(Key(2)));
  EXPECT_TRUE(cache.Get(Key(3)));
  EXPECT_TRUE(cache.Get(Key(4)));
}

TEST(DiskCache, ForeignFilesAreNeitherCountedNorDeleted) {
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 200);
  const std::vector<fs::path> others = {folder / "my_scan.bin", folder / (Key(9) + ".bin"),
                                        folder / (Key(8) + ".txt")};
  for (const fs::path& other : others) {
    WriteFileAtomically(other, std::string(5000, 'x'));
    fs::last_write_time(other, fs::file_time_type::clock::now() - std::chrono::hours(24));
  }
  cache.Put(Key(1), "a");
  cache.Put(Key(2), std::string(100, 'b'));
  EXPECT_FALSE(cache.Get(Key(1)));
  EXPECT_TRUE(cache.Get(Key(2)));
  for (const fs::path& other : others) {
    EXPECT_EQ(ReadFileBytes(other), std::string(5000, 'x')) << other;
  }
}

TEST(DiskCache, ConcurrentReadersGetWholeValuesOrNone) {
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 5000);
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&cache, t] {
      for (int n = 0; n < 40; ++n) {
        const int which = (n * 7 + t) % 5;
        cache.Put(Key(which), std::string(500 + which, static_cast<char>('a' + which)));
        const auto bytes = cache.Get(Key((which + 1) % 5));
        if (bytes) {
          EXPECT_EQ(*bytes,
                    std::string(500 + (which + 1) % 5, static_cast<char>('a' + (which + 1) % 5)));
        }
      }
    });
  }
}

TEST(ImplicitCache, ReturnsTheSameFaceWithoutComputingItAgain) {
  const ScratchFolder folder;
  const DiskCache cache(folder.Path(), 1 << 28);
  const Phantom phantom = MakePhantom({.random_seed = 1, .rings = 20});
  ImplicitFaceOptions options;
  options.resolution = 16;
  const ImplicitFace made =
      CachedImplicitFace(phantom.skull, phantom.depth_mm, options, &cache, {});
  EXPECT_EQ(ToBytes(made),
            ToBytes(BuildImplicitFace(phantom.skull, phantom.depth_mm, options, {})));
  // A marked face in the cache proves that the second call reads it.
  ImplicitFace marked = made;
  marked.notes.push_back("from the cache");
  const fs::path file = *fs::directory_iterator(folder.Path());
  cache.Put(file.stem().string(), ToBytes(marked));
  EXPECT_EQ(ToBytes(CachedImplicitFace(phantom.skull, phantom.depth_mm, options, &cache, {})),
            ToBytes(marked));
  options.resolution = 17;
  EXPECT_NE(ToBytes(CachedImplicitFace(phantom.skull, phantom.depth_mm, options, &cache, {})),
            ToBytes(marked));
}

TEST(ImplicitCache, DamagedBytesAreNoFace) {
  ImplicitFace face;
  face.notes = {"a", "note"};
  const std::string bytes = ToBytes(face);
  EXPECT_EQ(ImplicitFaceFrom(bytes)->notes, face.notes);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(ImplicitFaceFrom(bytes.substr(0, size)));
  }
  EXPECT_FALSE(ImplicitFaceFrom(bytes + "x"));
  EXPECT_FALSE(ImplicitFaceFrom(std::string(400, '\xff')));
}

}  // namespace
}  // namespace semblance::problems
