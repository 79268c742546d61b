// SPDX-License-Identifier: GPL-3.0-or-later
// The commands phantom and import-ct, called as a program, from the scanner's files to a face.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "surfaces/base/atomic_file.h"
#include "tests/testing/program_call.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::CallProgram;
using ::testing::HasSubstr;

const std::string kImportConfigs = SEMBLANCE_SOURCE_DIR "/configs";

class ImportCommands : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(
        CallProgram(folder_, "phantom --head smooth --out head --pixel-mm 2.5 --slice-mm 3").code,
        0);
  }
  // Expects one line of error, exit code 2, and no new files.
  void ExpectRefused(const std::string& arguments, const std::string& words) {
    const testing::Outcome outcome = CallProgram(folder_, arguments + " --quiet --out out");
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << arguments;
  }
  testing::ScratchFolder folder_;
};

TEST_F(ImportCommands, ASeriesBecomesSkullAndSkinAndTheNextCommandIsPrinted) {
  const testing::Outcome outcome = CallProgram(folder_, "import-ct head/ct --quiet --out out");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(folder_ / "out/skull.ply"));
  EXPECT_TRUE(fs::exists(folder_ / "out/skin.ply"));
  EXPECT_THAT(outcome.out,
              AllOf(HasSubstr("note: series 1: CT"), HasSubstr("head holder"),
                    HasSubstr("next: semblance workbench "), HasSubstr("out/skull.ply\n")));
}

TEST_F(ImportCommands, OnlyTheSkinOfAnMrIsImported) {
  const testing::Outcome outcome =
      CallProgram(folder_, "import-ct head/ct --modality mr --skin-value 1 --quiet --out out");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_FALSE(fs::exists(folder_ / "out/skull.ply"));
  EXPECT_TRUE(fs::exists(folder_ / "out/skin.ply"));
}

TEST_F(ImportCommands, WrongInputGivesOneLine) {
  ExpectRefused("import-ct nowhere", "nowhere: no such file or folder");
  ExpectRefused("import-ct head/landmarks.yaml", "not a kind of volume");
  ExpectRefused("import-ct head/ct/slice0001.dcm", "name its folder");
  ExpectRefused("import-ct head/ct --skin-value 30", "--skin-value is for an MR");
  fs::remove(folder_ / "head/ct/slice0031.dcm");
  ExpectRefused("import-ct head/ct", "1 missing slices");
}

TEST_F(ImportCommands, AHeadThatCannotBeMadeLeavesNoFolder) {
  for (const char* wrong : {"--volume head.mhd", "--volume head.NHDR", "--volume head.txt",
                            "--volume a/head.mha", "--volume .mha", "--lost nose"}) {
    const testing::Outcome outcome =
        CallProgram(folder_, fmt::format("phantom --head smooth --out one {}", wrong));
    EXPECT_EQ(outcome.code, 2) << wrong;
    EXPECT_THAT(outcome.err,
                ::testing::AnyOf(HasSubstr("not a plain name"), HasSubstr("no site 'nose'")));
    EXPECT_FALSE(fs::exists(folder_ / "one")) << wrong;
  }
}

TEST_F(ImportCommands, AHeadMayHaveRoughBoneThorough) {
  const auto bytes = [&](const char* path) { return ReadFileBytes(folder_ / path); };
  ASSERT_EQ(
      CallProgram(folder_, "phantom --out rough --head like_people --pixel-mm 2.5 --slice-mm 3")
          .code,
      0);
  EXPECT_NE(bytes("rough/landmarks.yaml"), bytes("head/landmarks.yaml"));
  EXPECT_EQ(CallProgram(folder_, "import-ct rough/ct --quiet --out out").code, 0);
  EXPECT_EQ(CallProgram(folder_, "phantom --out one --head rough").code, 2);
  EXPECT_FALSE(fs::exists(folder_ / "one"));
}

TEST_F(ImportCommands, ASubjectMayBeAFolderOfDicom) {
  WriteFileAtomically(
      folder_ / "run.yaml",
      fmt::format("subject: {{type: ct, volume: head/ct, landmarks: head/landmarks.yaml}}\n"
                  "tissue: {{depths: measured}}\nnetwork: {}/networks/standard32.yaml\n",
                  kImportConfigs));
  const testing::Outcome outcome = CallProgram(folder_, "check run.yaml");
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("no fault found"));
}

}  // namespace
}  // namespace semblance::problems
