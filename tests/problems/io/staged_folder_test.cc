// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/staged_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>
#include <set>
#include <string_view>

#include "surfaces/base/error.h"
#include "tests/testing/scratch_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::ScratchFolder;
using testing::WordsOf;
using Names = std::set<std::string>;

// The names of all files and folders below `folder`.
Names NamesIn(const fs::path& folder) {
  Names names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.insert(entry.path().lexically_relative(folder).generic_string());
  }
  return names;
}

void Fill(StagedFolder& staged) {
  staged.Files().Write("result.json", "new");
  staged.Files().Write("pictures/front.png", "png");
  staged.Files().Write("manifest.json", "all");
}

const Names kAll = {"result.json", "pictures", "pictures/front.png", "manifest.json"};

TEST(StagedFolder, FilesAppearTogether) {
  const ScratchFolder folder;
  StagedFolder staged(folder / "a/b", WhenNotEmpty::kRefuse);
  Fill(staged);
  EXPECT_FALSE(fs::exists(folder / "a/b"));
  staged.Publish();
  EXPECT_EQ(NamesIn(folder / "a/b"), kAll);
  EXPECT_EQ(NamesIn(folder / "a").size(), 1 + kAll.size());
}

TEST(StagedFolder, WithoutPublishNothingRemainsNotEvenParentFolders) {
  const ScratchFolder folder;
  fs::create_directories(folder / "mine");
  {
    StagedFolder staged(folder / "mine/a/b", WhenNotEmpty::kRefuse);
    Fill(staged);
  }
  EXPECT_EQ(NamesIn(folder.Path()), Names{"mine"});
}

TEST(StagedFolder, AnEmptyFolderKeepsItsPermissions) {
  const ScratchFolder folder;
  fs::create_directories(folder / "out");
  fs::permissions(folder / "out", fs::perms::owner_all);
  StagedFolder staged(folder / "out", WhenNotEmpty::kRefuse);
  Fill(staged);
  EXPECT_EQ(NamesIn(folder / "out"), Names{});
  staged.Publish();
  EXPECT_EQ(NamesIn(folder / "out"), kAll);
  EXPECT_EQ(fs::status(folder / "out").permissions(), fs::perms::owner_all);
}

TEST(StagedFolder, OtherFilesInTheFolderStay) {
  const ScratchFolder folder;
  fs::create_directories(folder / "out/pictures");
  std::ofstream(folder / "out/mine.txt") << "mine";
  std::ofstream(folder / "out/pictures/mine.png") << "mine";
  std::ofstream(folder / "out/result.json") << "old";
  EXPECT_THAT(WordsOf<IoError>([&] { StagedFolder(folder / "out", WhenNotEmpty::kRefuse); }),
              HasSubstr("exists and is not empty"));
  {
    StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles);
    Fill(staged);
    EXPECT_EQ(ReadFileBytes(folder / "out/result.json"), "old");
  }
  EXPECT_EQ(ReadFileBytes(folder / "out/result.json"), "old") << "not published";
  StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles);
  Fill(staged);
  staged.Publish();
  EXPECT_EQ(ReadFileBytes(folder / "out/result.json"), "new");
  Names all = kAll;
  all.insert({"mine.txt", "pictures/mine.png"});
  EXPECT_EQ(NamesIn(folder / "out"), all);
}

TEST(StagedFolder, AFolderWithTheNameOfAFileStopsPublishingWithoutLoss) {
  const ScratchFolder folder;
  fs::create_directories(folder / "out/result.json");
  std::ofstream(folder / "out/manifest.json") << "old";
  StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles);
  Fill(staged);
  EXPECT_THAT(WordsOf<IoError>([&] { staged.Publish(); }),
              AllOf(HasSubstr("result.json is a folder there"), HasSubstr("out.kept-1")));
  EXPECT_EQ(ReadFileBytes(folder / "out/manifest.json"), "old");
  EXPECT_EQ(NamesIn(folder / "out.kept-1"), kAll);
}

TEST(StagedFolder, FilesThatAppearInTheMeantimeAreNotOverwritten) {
  const ScratchFolder folder;
  StagedFolder staged(folder / "out", WhenNotEmpty::kRefuse);
  Fill(staged);
  fs::create_directories(folder / "out");
  std::ofstream(folder / "out/result.json") << "mine";
  EXPECT_THAT(WordsOf<IoError>([&] { staged.Publish(); }), HasSubstr("out.kept-1"));
  EXPECT_EQ(ReadFileBytes(folder / "out/result.json"), "mine");
  EXPECT_EQ(NamesIn(folder / "out.kept-1"), kAll);
}

TEST(StagedFolder, ASecondStagedFolderIsRefusedWhileTheFirstExists) {
  const ScratchFolder folder;
  for (const WhenNotEmpty when : {WhenNotEmpty::kRefuse, WhenNotEmpty::kReplaceFiles}) {
    StagedFolder first(folder / "out", when);
    EXPECT_THAT(WordsOf<IoError>([&] { StagedFolder(folder / "out", when); }),
                HasSubstr("another process is writing it"));
    Fill(first);
    first.Publish();
    StagedFolder next(folder / "out", WhenNotEmpty::kReplaceFiles);
    fs::remove_all(folder / "out");
  }
}

TEST(StagedFolder, TheFolderOfAKilledProcessIsTakenOver) {
  for (const bool is_full : {false, true}) {
    const ScratchFolder folder;
    if (is_full) {
      fs::create_directories(folder / "out");
      std::ofstream(folder / "out/mine.txt") << "mine";
    }
    const pid_t child = ::fork();
    if (child == 0) {
      StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles);
      staged.Files().Write("left.txt", "half");
      ::raise(SIGKILL);
    }
    ::waitpid(child, nullptr, 0);
    const Names left = NamesIn(folder.Path());
    EXPECT_TRUE(
        left.contains(is_full ? "out/.semblance-part/left.txt" : ".out.semblance-part/left.txt"));
    StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles);
    Fill(staged);
    staged.Publish();
    Names all = kAll;
    if (is_full) {
      all.insert("mine.txt");
    }
    EXPECT_EQ(NamesIn(folder / "out"), all);
    EXPECT_EQ(NamesIn(folder.Path()).size(), all.size() + 1);
  }
}

TEST(StagedFolder, ALinkInTheFolderLeadsNoFileElsewhere) {
  const ScratchFolder folder;
  fs::create_directories(folder / "elsewhere");
  fs::create_directories(folder / "out");
  std::ofstream(folder / "out/mine.txt") << "mine";
  fs::create_directory_symlink(folder / "elsewhere", folder / "out/pictures");
  StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles);
  Fill(staged);
  EXPECT_THAT(WordsOf<IoError>([&] { staged.Publish(); }),
              AllOf(HasSubstr("out/pictures: it is a link"), HasSubstr("out.kept-1")));
  EXPECT_TRUE(fs::is_empty(folder / "elsewhere"));
  EXPECT_EQ(NamesIn(folder / "out.kept-1"), kAll) << "the result is not lost";
}

TEST(StagedFolder, APreparedStagingFolderIsNotUsed) {
  const ScratchFolder folder;
  fs::create_directories(folder / "elsewhere");
  std::ofstream(folder / "elsewhere/mine.txt") << "mine";
  fs::create_directory_symlink(folder / "elsewhere", folder / ".out.semblance-part");
  EXPECT_THROW(StagedFolder(folder / "out", WhenNotEmpty::kRefuse), IoError);
  EXPECT_EQ(NamesIn(folder / "elsewhere"), Names{"mine.txt"});
  if (::geteuid() != 0) {
    GTEST_SKIP() << "only root can make a folder of another user";
  }
  fs::create_directories(folder / ".b.semblance-part");
  ASSERT_EQ(::chown((folder / ".b.semblance-part").c_str(), 12345, 12345), 0);
  EXPECT_THAT(WordsOf<IoError>([&] { StagedFolder(folder / "b", WhenNotEmpty::kRefuse); }),
              HasSubstr("another user of this machine has left"));
}

TEST(StagedFolder, AnInputFileIsRefusedUnderAnyNameBeforeWork) {
  const ScratchFolder folder;
  fs::create_directories(folder / "out/pictures");
  std::ofstream(folder / "out/pictures/front.png") << "mine";
  std::ofstream(folder / "out/mine.txt") << "mine";
  fs::create_symlink(folder / "out", folder / "other");
  fs::create_symlink(folder / "out/pictures/front.png", folder / "link");
  constexpr std::array<std::string_view, 2> kOutputs = {"result.json", "pictures/*"};
  for (const char* given :
       {"out/pictures/front.png", "other/pictures/../pictures/front.png", "link"}) {
    EXPECT_THAT(WordsOf<InputError>([&] {
                  StagedFolder(folder / "out", WhenNotEmpty::kReplaceFiles,
                               {.files = {folder / given}, .outputs = kOutputs});
                }),
                AllOf(HasSubstr(given), HasSubstr("by the pictures/front.png"),
                      HasSubstr((folder / "out").string()), HasSubstr("give another --out")))
        << given;
  }
  StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles,
                      {.files = {folder / "out/mine.txt", "-", ""}, .outputs = kOutputs});
  Fill(staged);
  EXPECT_NO_THROW(staged.Publish()) << "no output has its name";
  EXPECT_EQ(ReadFileBytes(folder / "out/mine.txt"), "mine");
}

TEST(StagedFolder, AnInputFileWithAnUnexpectedNameStaysToo) {
  const ScratchFolder folder;
  fs::create_directories(folder / "out");
  std::ofstream(folder / "out/result.json") << "mine";
  std::ofstream(folder / "out/manifest.json") << "old";
  StagedFolder staged(folder / "out", WhenNotEmpty::kReplaceFiles,
                      {.files = {folder / "out/result.json"}});
  Fill(staged);
  EXPECT_THAT(WordsOf<IoError>([&] { staged.Publish(); }),
              AllOf(HasSubstr("result.json is a file that was read"), HasSubstr("out.kept-1")));
  EXPECT_EQ(ReadFileBytes(folder / "out/result.json"), "mine");
  EXPECT_EQ(ReadFileBytes(folder / "out/manifest.json"), "old");
  EXPECT_EQ(NamesIn(folder / "out.kept-1"), kAll);
}

TEST(StagedFolder, AFileWithTheNameOfTheFolderIsNotChanged) {
  const ScratchFolder folder;
  std::ofstream(folder / "out") << "mine";
  EXPECT_THROW(StagedFolder(folder / "out", WhenNotEmpty::kReplaceFiles), IoError);
  EXPECT_THROW(StagedFolder(folder / "out/a", WhenNotEmpty::kReplaceFiles), IoError);
  EXPECT_THROW(StagedFolder("/proc/semblance", WhenNotEmpty::kRefuse), IoError);
  EXPECT_EQ(NamesIn(folder.Path()), Names{"out"});
}

}  // namespace
}  // namespace semblance::problems
