// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/output/files.h"

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

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class FilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("semblance_files_" + std::to_string(::getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Files and folders in `folder`, without recursion.
  static int Count(const fs::path& folder) {
    return static_cast<int>(
        std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }

  fs::path folder_;
};

template <class ErrorType, class Function>
std::string MessageOf(Function&& function) {
  try {
    function();
  } catch (const ErrorType& error) {
    return error.what();
  }
  return "no error";
}

TEST_F(FilesTest, BytesComeBackAndNothingElseIsLeft) {
  const std::string bytes("a\0b\r\n\xff", 6);
  WriteFileAtomically(folder_ / "x.bin", bytes);
  EXPECT_EQ(ReadFileBytes(folder_ / "x.bin"), bytes);
  WriteFileAtomically(folder_ / "x.bin", "");
  EXPECT_EQ(ReadFileBytes(folder_ / "x.bin"), "");
  EXPECT_EQ(Count(folder_), 1);
}

TEST_F(FilesTest, MissingFolderIsOneClearError) {
  EXPECT_THAT(MessageOf<IoError>([&] { WriteFileAtomically(folder_ / "none" / "x", "1"); }),
              AllOf(HasSubstr((folder_ / "none" / "x").string() + ": cannot be written: "),
                    HasSubstr("No such file or directory")));
}

TEST_F(FilesTest, FailureLeavesTheTargetAsItWasAndNoTemporaryFile) {
  fs::create_directories(folder_ / "target" / "inside");  // a folder cannot be renamed over
  EXPECT_THAT(MessageOf<IoError>([&] { WriteFileAtomically(folder_ / "target", "1"); }),
              HasSubstr("Is a directory"));
  EXPECT_TRUE(fs::is_directory(folder_ / "target" / "inside"));
  EXPECT_EQ(Count(folder_), 1);
}

TEST_F(FilesTest, OldFileSurvivesAWriteThatStopsHalfWay) {
  WriteFileAtomically(folder_ / "x", "old");
  rlimit limit;
  ::getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit small{.rlim_cur = 1000, .rlim_max = limit.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);  // so that the write fails, as it does on a full disk
  ::setrlimit(RLIMIT_FSIZE, &small);
  const std::string message =
      MessageOf<IoError>([&] { WriteFileAtomically(folder_ / "x", std::string(5000, 'n')); });
  ::setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_THAT(message, HasSubstr("x: cannot be written: File too large"));
  EXPECT_EQ(ReadFileBytes(folder_ / "x"), "old");
  EXPECT_EQ(Count(folder_), 1);
}

TEST_F(FilesTest, WhatCannotBeReadIsNamedWithItsReason) {
  EXPECT_THAT(MessageOf<IoError>([&] { ReadFileBytes(folder_ / "none"); }),
              HasSubstr("none: no such file"));
  EXPECT_THAT(MessageOf<IoError>([&] { ReadFileBytes(folder_); }), HasSubstr("is a folder"));
  std::filesystem::create_symlink("round", folder_ / "round");
  EXPECT_THAT(MessageOf<IoError>([&] { ReadFileBytes(folder_ / "round"); }),
              HasSubstr("round: cannot be read: Too many levels of symbolic links"));
}

TEST_F(FilesTest, APipeHasNoSizeAndIsReadToItsEnd) {
  ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  const std::string bytes(100000, 'x');
  std::thread writer([&] { std::ofstream(folder_ / "pipe") << bytes; });
  EXPECT_EQ(ReadFileBytes(folder_ / "pipe"), bytes);
  writer.join();
}

TEST_F(FilesTest, WhatAKilledProcessHasLeftIsSweptAndNothingElse) {
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
  OutputFolder out(folder_, WhenNotEmpty::kReplaceFiles);
  out.Write("face.ply", "new");
  EXPECT_EQ(Count(folder_), static_cast<int>(others.size()) + 1);
  EXPECT_EQ(ReadFileBytes(folder_ / "face.ply"), "new");
}

TEST_F(FilesTest, ATemporaryFileThatIsBeingWrittenIsNotSwept) {
  const int descriptor = ::open((folder_ / ".x.1-2.tmp").c_str(), O_WRONLY | O_CREAT, 0600);
  ASSERT_EQ(::flock(descriptor, LOCK_EX), 0);
  SweepTemporaryFiles(folder_);
  EXPECT_EQ(Count(folder_), 1);
  ::close(descriptor);
  SweepTemporaryFiles(folder_);
  EXPECT_EQ(Count(folder_), 0);
}

TEST_F(FilesTest, WhatHasNoEndIsRefused) {
  EXPECT_THAT(MessageOf<IoError>([] { ReadFileBytes("/dev/zero"); }),
              HasSubstr("/dev/zero: more than 256 MB"));
}

TEST_F(FilesTest, AFileLargerThanMemoryIsSaid) {
#ifdef SEMBLANCE_SANITIZED
  GTEST_SKIP() << "a sanitizer ends what asks for so much";
#endif
  std::ofstream(folder_ / "huge").close();
  std::error_code error;
  fs::resize_file(folder_ / "huge", std::uintmax_t{1} << 43, error);
  if (error) {
    GTEST_SKIP() << "no sparse files of this size here";
  }
  EXPECT_THAT(MessageOf<IoError>([&] { ReadFileBytes(folder_ / "huge"); }),
              HasSubstr("huge: not enough memory for its 8388608 MB"));
}

TEST_F(FilesTest, OutputFolderIsCreatedEmptyAndTakesFilesInSubfolders) {
  OutputFolder out(folder_ / "a" / "b", WhenNotEmpty::kRefuse);
  EXPECT_EQ(Count(out.Root()), 0);
  out.Write("pictures/front.png", "png");
  EXPECT_EQ(ReadFileBytes(folder_ / "a/b/pictures/front.png"), "png");
  EXPECT_EQ(Count(out.Root() / "pictures"), 1);
}

TEST_F(FilesTest, NotEmptyFolderIsRefusedInTheseWords) {
  OutputFolder first(folder_ / "run", WhenNotEmpty::kRefuse);
  first.Write("result.json", "{}");
  EXPECT_EQ(MessageOf<IoError>([&] { OutputFolder(folder_ / "run", WhenNotEmpty::kRefuse); }),
            (folder_ / "run").string() +
                ": the output folder exists and is not empty, and nothing is overwritten unless "
                "asked; choose another folder, or say --force to replace files in it");
  OutputFolder forced(folder_ / "run", WhenNotEmpty::kReplaceFiles);
  EXPECT_EQ(ReadFileBytes(forced.Root() / "result.json"), "{}") << "force deletes nothing";
}

TEST_F(FilesTest, FolderThatCannotBeIsKnownAtOnce) {
  WriteFileAtomically(folder_ / "file", "1");
  EXPECT_THAT(MessageOf<IoError>([&] { OutputFolder(folder_ / "file", WhenNotEmpty::kRefuse); }),
              HasSubstr("file: the folder cannot be created"));
  // /proc refuses new files even to the superuser.
  EXPECT_THAT(MessageOf<IoError>([&] { OutputFolder("/proc/self", WhenNotEmpty::kReplaceFiles); }),
              HasSubstr("/proc/self: the output folder cannot be written to: "));
  EXPECT_THAT(MessageOf<IoError>([&] { OutputFolder("/proc/semblance", WhenNotEmpty::kRefuse); }),
              HasSubstr("/proc/semblance: the folder cannot be created: "));
}

TEST_F(FilesTest, NamesMustStayInsideTheFolder) {
  OutputFolder out(folder_ / "run", WhenNotEmpty::kRefuse);
  for (const char* name : {"", ".", "..", "../x", "a/../../x", "/etc/x", "a/"}) {
    EXPECT_THROW(out.Write(name, "1"), InputError) << name;
  }
  EXPECT_EQ(Count(folder_), 1);
}

}  // namespace
}  // namespace semblance
