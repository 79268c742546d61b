// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class TrialFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    Write("face.ply", "mesh");
    Write("pictures/front.png", "png");
    Write("timing.json", "{}");
    WriteTrial({{"id", "a"},
                {"status", "done"},
                {"files", HashesOf(From(), {"face.ply", "pictures/front.png"})}});
  }

  fs::path From() const { return TrialFolder(folder_ / "from", "a"); }
  fs::path To() const { return TrialFolder(folder_ / "to", "a"); }
  void Write(const fs::path& name, const std::string& text) const {
    fs::create_directories((From() / name).parent_path());
    WriteFileAtomically(From() / name, text);
  }
  void WriteTrial(const nlohmann::ordered_json& json) const { Write("trial.json", json.dump()); }
  std::string Copy() const { return CopyTrial(folder_ / "from", folder_ / "to", "a"); }
  // Refused, and nothing has come to where it should go.
  void ExpectNotTaken(const std::string& words) const {
    EXPECT_THAT(Copy(), HasSubstr(words));
    EXPECT_FALSE(fs::exists(To()));
  }

  testing::ScratchFolder folder_;
};

TEST_F(TrialFolders, AWholeTrialIsCopiedWhole) {
  EXPECT_THAT(Copy(), IsEmpty());
  for (const char* name : {"face.ply", "pictures/front.png", "timing.json", "trial.json"}) {
    EXPECT_EQ(ReadFileBytes(To() / name), ReadFileBytes(From() / name)) << name;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "to/trials"), {}), 1);
}

TEST_F(TrialFolders, AFileThatIsMissingOrChangedIsFound) {
  Write("face.ply", "mesj");
  ExpectNotTaken("face.ply is not what was written");
  fs::remove(From() / "face.ply");
  ExpectNotTaken("face.ply is missing");
}

TEST_F(TrialFolders, TheManifestOfARunCountsToo) {
  WriteTrial({{"id", "a"}, {"status", "done"}});
  nlohmann::ordered_json manifest;
  manifest["outputs"] = HashesOf(From(), {"face.ply"});
  Write("manifest.json", manifest.dump());
  EXPECT_THAT(Copy(), IsEmpty());
  fs::remove_all(To());
  Write("face.ply", "m");
  ExpectNotTaken("face.ply is not what was written");
  Write("manifest.json", "{");
  ExpectNotTaken("manifest.json cannot be read");
}

TEST_F(TrialFolders, NoLinkIsFollowedOutOfATrial) {
  WriteFileAtomically(folder_ / "secret", "secret");
  fs::create_symlink(folder_ / "secret", From() / "note.txt");
  ExpectNotTaken("note.txt is a link or a device");
  fs::remove(From() / "note.txt");
  fs::create_directory_symlink(folder_.Path(), From() / "all");
  ExpectNotTaken("all is a link or a device");
  fs::remove(From() / "all");
  ASSERT_EQ(::mkfifo((From() / "pipe").c_str(), 0600), 0);
  ExpectNotTaken("pipe is a link or a device");
  fs::remove(From() / "pipe");
  WriteTrial({{"id", "a"}, {"files", {{{"file", "../../../secret"}, {"sha256", "x"}}}}});
  ExpectNotTaken("../../../secret is missing");
  fs::rename(From(), folder_ / "real");
  fs::create_directory_symlink(folder_ / "real", From());
  ExpectNotTaken("it is a link");
}

TEST_F(TrialFolders, WhatIsNotWholeIsNotATrial) {
  for (const char* text : {"", "{", "[]", "{\"id\": \"b\"}", "{\"id\": 1}",
                           "{\"id\": \"a\", \"status\": 3}", "{\"id\": \"a\", \"reason\": []}"}) {
    Write("trial.json", text);
    EXPECT_FALSE(ReadTrialFile(folder_ / "from", "a")) << text;
    ExpectNotTaken("it is not whole");
  }
}

TEST_F(TrialFolders, WhatABrokenTrialHasLeftIsReplacedAndOtherFilesStay) {
  fs::create_directories(To());
  WriteFileAtomically(To() / "trial.json", "{");
  WriteFileAtomically(To() / "mine.txt", "mine");
  EXPECT_THAT(Copy(), IsEmpty());
  EXPECT_TRUE(ReadTrialFile(folder_ / "to", "a"));
  EXPECT_EQ(ReadFileBytes(To() / "mine.txt"), "mine");
}

TEST_F(TrialFolders, APlanIsOfAStudyOrAnError) {
  EXPECT_EQ(PlanHashOf(folder_ / "from"), "");
  const fs::path file = folder_ / "from/plan.json";
  for (const char* text : {"", "{", "[]", "{}", "{\"hash\": 7}"}) {
    WriteFileAtomically(file, text);
    EXPECT_THROW(PlanHashOf(folder_ / "from"), IoError) << text;
  }
  WriteFileAtomically(file, "{\"hash\": \"h\"}");
  EXPECT_EQ(PlanHashOf(folder_ / "from"), "h");
}

}  // namespace
}  // namespace semblance
