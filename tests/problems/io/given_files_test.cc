// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/given_files.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "problems/io/staged_folder.h"
#include "problems/report/run_folder.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using testing::ScratchFolder;
using ::testing::UnorderedElementsAre;

class GivenFilesTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) const {
    fs::create_directories((folder_ / name).parent_path());
    WriteFileAtomically(folder_ / name, bytes);
  }
  // Writes the manifest of a run that wrote `bytes` to each file.
  void WriteManifest(const std::vector<std::string>& names, const std::string& bytes) const {
    std::string lines;
    for (const std::string& name : names) {
      lines += fmt::format(R"({}{{"file": "{}", "sha256": "{}"}})", lines.empty() ? "" : ", ", name,
                           Sha256OfText(bytes));
    }
    Write("manifest.json", fmt::format(R"({{"outputs": [{}]}})", lines));
  }

  ScratchFolder folder_;
};

TEST_F(GivenFilesTest, OldFilesOfARunAreUnchangedFilesOfItsManifest) {
  const std::vector<std::string> names = {"face.ply", "sample_0.ply", "sample_1.ply",
                                          "alternatives/a.json", "mine.txt"};
  for (const std::string& name : names) {
    Write(name, "old");
  }
  Write("sample_1.ply", "mine");
  Write("sample_2.ply", "old");  // not in the manifest
  WriteManifest(names, "old");
  EXPECT_THAT(OldFiles(folder_.Path(), {.files = {}, .outputs = kRunFiles}, {"face.ply"}),
              UnorderedElementsAre("sample_0.ply", "alternatives/a.json"));
  EXPECT_THAT(OldFiles(folder_.Path(), {.files = {folder_ / "sample_0.ply"}, .outputs = kRunFiles},
                       {"face.ply", "alternatives/a.json"}),
              IsEmpty())
      << "an input file stays";
}

TEST_F(GivenFilesTest, AnOddManifestHasNoOldFiles) {
  Write("outside.png", "old");
  Write("run/pictures/front.png", "old");
  for (const char* text : {"", "[]", "{\"outputs\": 1}", "{\"outputs\": [1, {}, {\"file\": 2}]}"}) {
    Write("run/manifest.json", text);
    EXPECT_THAT(OldFiles(folder_ / "run", {.files = {}, .outputs = kRunFiles}, {}), IsEmpty())
        << text;
  }
  WriteManifest({"pictures/../../outside.png", (folder_ / "outside.png").string()}, "old");
  fs::rename(folder_ / "manifest.json", folder_ / "run/manifest.json");
  EXPECT_THAT(OldFiles(folder_ / "run", {.files = {}, .outputs = kRunFiles}, {}), IsEmpty());
}

TEST_F(GivenFilesTest, WithoutAManifestOldFilesAreThoseWithAMark) {
  constexpr std::array<FileMark, 1> kMarks = {FileMark{R"(part_\d+\.txt)", "made here"}};
  Write("part_1.txt", "# made here\n");
  Write("part_2.txt", "# made here\n");
  Write("part_3.txt", "# mine\n");
  Write("part_a.txt", "# made here\n");
  Write("below/part_4.txt", "# made here\n");
  EXPECT_THAT(OldFiles(folder_.Path(), {.files = {}, .marks = kMarks}, {"part_1.txt"}),
              ElementsAre("part_2.txt"));
}

TEST_F(GivenFilesTest, PublishingRemovesOldFiles) {
  Write("out/face.ply", "old");
  Write("out/bust_textures/skin.png", "old");
  Write("out/pictures/old.png", "old");
  Write("out/pictures/mine.png", "mine");
  WriteManifest({"face.ply", "bust_textures/skin.png", "pictures/old.png"}, "old");
  fs::rename(folder_ / "manifest.json", folder_ / "out/manifest.json");
  StagedFolder staged(folder_ / "out", WhenNotEmpty::kReplaceFiles,
                      {.files = {}, .outputs = kRunFiles});
  staged.Files().Write("face.ply", "new");
  staged.Files().Write("manifest.json", "{}");
  EXPECT_TRUE(fs::exists(folder_ / "out/pictures/old.png"));
  staged.Publish();
  EXPECT_EQ(ReadFileBytes(folder_ / "out/face.ply"), "new");
  EXPECT_FALSE(fs::exists(folder_ / "out/bust_textures"));
  EXPECT_FALSE(fs::exists(folder_ / "out/pictures/old.png"));
  EXPECT_TRUE(fs::exists(folder_ / "out/pictures/mine.png"));
}

}  // namespace
}  // namespace semblance::problems
