// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/output_folder.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <thread>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

// Replaces the system's random numbers by 1, 2, 3 ... while `random_count` is not negative.
static std::int64_t random_count = -1;
extern "C" ssize_t getrandom(void* buffer, size_t size, unsigned flags) {
  if (random_count < 0) {
    return ::syscall(SYS_getrandom, buffer, size, flags);
  }
  ++random_count;
  std::memset(buffer, 0, size);
  std::memcpy(buffer, &random_count, std::min(size, sizeof random_count));
  return static_cast<ssize_t>(size);
}

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::WordsOf;

class OutputFolderTest : public ::testing::Test {
 protected:
  // The number of files and folders in `folder`, without recursion.
  static int Count(const fs::path& folder) {
    return static_cast<int>(
        std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }

  testing::ScratchFolder folder_;
};

TEST_F(OutputFolderTest, WrittenBytesAreReadBackAndNoOtherFileRemains) {
  const std::string bytes("a\0b\r\n\xff", 6);
  WriteFileAtomically(folder_ / "x.bin", bytes);
  EXPECT_EQ(ReadFileBytes(folder_ / "x.bin"), bytes);
  WriteFileAtomically(folder_ / "x.bin", "");
  EXPECT_EQ(ReadFileBytes(folder_ / "x.bin"), "");
  EXPECT_EQ(Count(folder_.Path()), 1);
}

// Somebody else has filled a shared folder with links and files of the temporary names.
TEST_F(OutputFolderTest, PreparedLinksAreNeitherFollowedNorReplaced) {
  std::ofstream(folder_ / "victim") << "precious";
  fs::create_directory(folder_ / "shared");
  for (int k = 1; k <= 3; ++k) {
    fs::create_symlink(folder_ / "victim",
                       folder_ / fmt::format("shared/.semblance-{:016x}.tmp", k));
  }
  fs::create_hard_link(folder_ / "victim", folder_ / "shared/.semblance-0000000000000004.tmp");
  fs::create_symlink(folder_ / "none", folder_ / "shared/.semblance-0000000000000005.tmp");
  for (const std::string& name :  // names of earlier versions
       {fmt::format(".semblance-probe.{}-0.tmp", ::getpid()),
        fmt::format(".x.bin.{}-0.tmp", ::getpid())}) {
    fs::create_symlink(folder_ / "victim", folder_ / "shared" / name);
  }
  random_count = 0;
  EXPECT_EQ(FindWritingFault(folder_ / "shared"), "");
  EXPECT_EQ(random_count, 6);
  random_count = 0;
  WriteFileAtomically(folder_ / "shared/x.bin", "new");
  EXPECT_EQ(random_count, 6);
  random_count = -1;
  EXPECT_EQ(ReadFileBytes(folder_ / "victim"), "precious");
  EXPECT_EQ(ReadFileBytes(folder_ / "shared/x.bin"), "new");
  EXPECT_FALSE(fs::exists(folder_ / "none"));
  EXPECT_EQ(Count(folder_ / "shared"), 8);
}

TEST_F(OutputFolderTest, ALinkAtTheTargetIsReplacedAndItsFileStays) {
  std::ofstream(folder_ / "victim") << "precious";
  fs::create_symlink(folder_ / "victim", folder_ / "x");
  WriteFileAtomically(folder_ / "x", "new");
  EXPECT_FALSE(fs::is_symlink(folder_ / "x"));
  EXPECT_EQ(ReadFileBytes(folder_ / "x"), "new");
  EXPECT_EQ(ReadFileBytes(folder_ / "victim"), "precious");
}

TEST_F(OutputFolderTest, ALinkBelowTheFolderLeadsNowhere) {
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directories(folder_ / "out/deep");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/pictures");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "out/deep/pictures");
  OutputFolder out(folder_ / "out", WhenNotEmpty::kReplaceFiles);
  for (const char* name : {"pictures/a.png", "deep/pictures/a.png", "pictures/more/a.png"}) {
    EXPECT_THAT(WordsOf<IoError>([&] { out.Write(name, "png"); }), HasSubstr("it is a link"));
  }
  EXPECT_EQ(Count(folder_ / "elsewhere"), 0);
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "named");
  OutputFolder(folder_ / "named", WhenNotEmpty::kRefuse).Write("deep/a.png", "png");
  EXPECT_EQ(ReadFileBytes(folder_ / "elsewhere/deep/a.png"), "png") << "the user named this link";
}

TEST_F(OutputFolderTest, MissingFolderIsOneClearError) {
  EXPECT_THAT(WordsOf<IoError>([&] { WriteFileAtomically(folder_ / "none" / "x", "1"); }),
              AllOf(HasSubstr((folder_ / "none" / "x").string() + ": cannot be written: "),
                    HasSubstr("No such file or directory")));
}

TEST_F(OutputFolderTest, AFailureKeepsTheTargetAndLeavesNoTemporaryFile) {
  fs::create_directories(folder_ / "target" / "inside");  // a folder cannot be renamed over
  EXPECT_THAT(WordsOf<IoError>([&] { WriteFileAtomically(folder_ / "target", "1"); }),
              HasSubstr("Is a directory"));
  EXPECT_TRUE(fs::is_directory(folder_ / "target" / "inside"));
  EXPECT_EQ(Count(folder_.Path()), 1);
}

TEST_F(OutputFolderTest, AnOldFileSurvivesAnIncompleteWrite) {
  WriteFileAtomically(folder_ / "x", "old");
  rlimit limit;
  ::getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit small{.rlim_cur = 1000, .rlim_max = limit.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);  // the write then fails as it does on a full disk
  ::setrlimit(RLIMIT_FSIZE, &small);
  const std::string message =
      WordsOf<IoError>([&] { WriteFileAtomically(folder_ / "x", std::string(5000, 'n')); });
  ::setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_THAT(message, HasSubstr("x: cannot be written: File too large"));
  EXPECT_EQ(ReadFileBytes(folder_ / "x"), "old");
  EXPECT_EQ(Count(folder_.Path()), 1);
}

TEST_F(OutputFolderTest, AnUnreadableFileIsNamedWithTheReason) {
  EXPECT_THAT(WordsOf<IoError>([&] { ReadFileBytes(folder_ / "none"); }),
              HasSubstr("none: no such file"));
  EXPECT_THAT(WordsOf<IoError>([&] { ReadFileBytes(folder_.Path()); }), HasSubstr("is a folder"));
  std::filesystem::create_symlink("round", folder_ / "round");
  EXPECT_THAT(WordsOf<IoError>([&] { ReadFileBytes(folder_ / "round"); }),
              HasSubstr("round: cannot be read: Too many levels of symbolic links"));
}

TEST_F(OutputFolderTest, APipeIsReadToItsEnd) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const std::string bytes(100000, 'x');
  std::thread writer([&] { std::ofstream(folder_ / "pipe") << bytes; });
  EXPECT_EQ(ReadFileBytes(folder_ / "pipe"), bytes);
  writer.join();
}

TEST_F(OutputFolderTest, OnlyFilesOfAKilledProcessAreSwept) {
  for (const char* name : {".semblance-0123456789abcdef.tmp", ".semblance-00000000000000ff.tmp"}) {
    std::ofstream(folder_ / name) << "half";
  }
  const std::vector<std::string> others = {"face.ply",
                                           ".semblance-0123456789abcde.tmp",
                                           ".semblance-0123456789abcdefg.tmp",
                                           ".semblance-0123456789abcdeF.tmp",
                                           "x.semblance-0123456789abcdef.tmp",
                                           ".semblance-0123456789abcdef.tmp.bak",
                                           ".semblance-part"};
  for (const std::string& name : others) {
    std::ofstream(folder_ / name) << "mine";
  }
  fs::create_symlink("face.ply", folder_ / ".semblance-1111111111111111.tmp");
  OutputFolder out(folder_.Path(), WhenNotEmpty::kReplaceFiles);
  out.Write("face.ply", "new");
  EXPECT_EQ(Count(folder_.Path()), static_cast<int>(others.size()) + 1);
  EXPECT_EQ(ReadFileBytes(folder_ / "face.ply"), "new");
}

TEST_F(OutputFolderTest, ATemporaryFileThatIsBeingWrittenIsNotSwept) {
  const int descriptor =
      ::open((folder_ / ".semblance-2222222222222222.tmp").c_str(), O_WRONLY | O_CREAT, 0600);
  ASSERT_EQ(::flock(descriptor, LOCK_EX), 0);
  SweepTemporaryFiles(folder_.Path());
  EXPECT_EQ(Count(folder_.Path()), 1);
  ::close(descriptor);
  SweepTemporaryFiles(folder_.Path());
  EXPECT_EQ(Count(folder_.Path()), 0);
}

TEST_F(OutputFolderTest, AFileWithoutEndIsRefused) {
  EXPECT_THAT(WordsOf<IoError>([] { ReadFileBytes("/dev/zero"); }),
              HasSubstr("/dev/zero: more than 256 MB"));
}

TEST_F(OutputFolderTest, AFileLargerThanMemoryIsAClearError) {
#ifdef SEMBLANCE_SANITIZED
  GTEST_SKIP() << "a sanitizer ends what asks for so much";
#endif
  std::ofstream(folder_ / "huge").close();
  std::error_code error;
  fs::resize_file(folder_ / "huge", std::uintmax_t{1} << 43, error);
  if (error) {
    GTEST_SKIP() << "no sparse files of this size here";
  }
  EXPECT_THAT(WordsOf<IoError>([&] { ReadFileBytes(folder_ / "huge"); }),
              HasSubstr("huge: not enough memory for its 8388608 MB"));
}

TEST_F(OutputFolderTest, IsCreatedEmptyAndWritesIntoSubfolders) {
  OutputFolder out(folder_ / "a" / "b", WhenNotEmpty::kRefuse);
  EXPECT_EQ(Count(out.Root()), 0);
  out.Write("pictures/front.png", "png");
  EXPECT_EQ(ReadFileBytes(folder_ / "a/b/pictures/front.png"), "png");
  EXPECT_EQ(Count(out.Root() / "pictures"), 1);
}

TEST_F(OutputFolderTest, AFolderThatIsNotEmptyIsRefused) {
  OutputFolder first(folder_ / "run", WhenNotEmpty::kRefuse);
  first.Write("result.json", "{}");
  EXPECT_EQ(WordsOf<IoError>([&] { OutputFolder(folder_ / "run", WhenNotEmpty::kRefuse); }),
            (folder_ / "run").string() +
                ": the output folder exists and is not empty, and nothing is overwritten unless "
                "asked; choose another folder, or add --force to replace files in it");
  OutputFolder forced(folder_ / "run", WhenNotEmpty::kReplaceFiles);
  EXPECT_EQ(ReadFileBytes(forced.Root() / "result.json"), "{}") << "force deletes nothing";
}

TEST_F(OutputFolderTest, AnImpossibleFolderIsRefusedAtOnce) {
  WriteFileAtomically(folder_ / "file", "1");
  EXPECT_THAT(WordsOf<IoError>([&] { OutputFolder(folder_ / "file", WhenNotEmpty::kRefuse); }),
              HasSubstr("file: the folder cannot be created"));
  // /proc refuses new files even to the superuser.
  EXPECT_THAT(WordsOf<IoError>([&] { OutputFolder("/proc/self", WhenNotEmpty::kReplaceFiles); }),
              HasSubstr("/proc/self: the output folder cannot be written to: "));
  EXPECT_THAT(WordsOf<IoError>([&] { OutputFolder("/proc/semblance", WhenNotEmpty::kRefuse); }),
              HasSubstr("/proc/semblance: the folder cannot be created: "));
}

TEST_F(OutputFolderTest, NamesMustStayInsideTheFolder) {
  OutputFolder out(folder_ / "run", WhenNotEmpty::kRefuse);
  for (const char* name : {"", ".", "..", "../x", "a/../../x", "/etc/x", "a/"}) {
    EXPECT_THROW(out.Write(name, "1"), InputError) << name;
  }
  EXPECT_EQ(Count(folder_.Path()), 1);
}

}  // namespace
}  // namespace semblance::problems
