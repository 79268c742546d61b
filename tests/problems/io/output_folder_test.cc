// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/output_folder.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

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
  for (const char* name : {".face.ply.123-4.tmp", ".a.1-0.tmp"}) {
    std::ofstream(folder_ / name) << "half";
  }
  const std::vector<std::string> others = {"face.ply",  ".face.ply.tmp",  ".1-2.tmp",
                                           "x.1-2.tmp", ".x.1-2.tmp.bak", ".x.-2.tmp",
                                           ".x.1-.tmp"};
  for (const std::string& name : others) {
    std::ofstream(folder_ / name) << "mine";
  }
  fs::create_symlink("face.ply", folder_ / ".link.1-2.tmp");
  OutputFolder out(folder_.Path(), WhenNotEmpty::kReplaceFiles);
  out.Write("face.ply", "new");
  EXPECT_EQ(Count(folder_.Path()), static_cast<int>(others.size()) + 1);
  EXPECT_EQ(ReadFileBytes(folder_ / "face.ply"), "new");
}

TEST_F(OutputFolderTest, ATemporaryFileThatIsBeingWrittenIsNotSwept) {
  const int descriptor = ::open((folder_ / ".x.1-2.tmp").c_str(), O_WRONLY | O_CREAT, 0600);
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
