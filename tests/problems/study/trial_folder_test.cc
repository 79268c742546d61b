// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/study/trial_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::json;
using ::testing::ElementsAre;
using ::testing::Pair;

class TrialFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    Write("face.ply", "mesh");
    Write("pictures/front.png", "png");
    Write("timing.json", "{}");
    WriteTrial({{"id", "a"},
                {"status", "done"},
                {"files", ListHashes(From(), {"face.ply", "pictures/front.png"})}});
  }

  fs::path From() const { return TrialFolder(folder_ / "from", "a"); }
  fs::path To() const { return TrialFolder(folder_ / "to", "a"); }
  void Write(const fs::path& name, const std::string& text) const {
    fs::create_directories((From() / name).parent_path());
    WriteFileAtomically(From() / name, text);
  }
  void WriteTrial(const nlohmann::ordered_json& json) const {
    Write("trial.json", TrialText(json, Maker::kThisProgram));
  }
  StoredTrial Read(TrialCheck check = TrialCheck::kAll) const {
    SharedNames names;
    return ReadTrial(folder_ / "from", "a", check, names);
  }
  std::string Copy() const { return CopyTrial(folder_ / "from", folder_ / "to", "a"); }
  // The copy is refused and writes nothing.
  void ExpectNotTaken(const std::string& words) const {
    EXPECT_THAT(Copy(), HasSubstr(words));
    EXPECT_FALSE(fs::exists(To()));
  }

  testing::ScratchFolder folder_;
};

TEST_F(TrialFolders, AWholeTrialIsCopiedCompletely) {
  EXPECT_THAT(Copy(), IsEmpty());
  for (const char* name : {"face.ply", "pictures/front.png", "timing.json", "trial.json"}) {
    EXPECT_EQ(ReadFileBytes(To() / name), ReadFileBytes(From() / name)) << name;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "to/trials"), {}), 1);
}

TEST_F(TrialFolders, AMissingOrChangedFileIsFound) {
  Write("face.ply", "mesj");
  ExpectNotTaken("face.ply is not what was written");
  fs::remove(From() / "face.ply");
  ExpectNotTaken("face.ply is missing");
}

TEST_F(TrialFolders, TheManifestOfARunIsCheckedToo) {
  WriteTrial({{"id", "a"}, {"status", "done"}});
  nlohmann::ordered_json manifest;
  manifest["outputs"] = ListHashes(From(), {"face.ply"});
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

TEST_F(TrialFolders, NoTrialIsWrittenThroughALink) {
  fs::create_directories(folder_ / "elsewhere");
  for (const char* place : {"to/trials/a", "to/trials"}) {
    fs::remove_all(folder_ / "to");
    fs::create_directories((folder_ / place).parent_path());
    fs::create_directory_symlink(folder_ / "elsewhere", folder_ / place);
    EXPECT_THROW(WritableTrialFolder(folder_ / "to", "a"), IoError) << place;
    EXPECT_THROW(Copy(), IoError) << place;
  }
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
  fs::remove_all(folder_ / "to");
  EXPECT_EQ(WritableTrialFolder(folder_ / "to", "a"), folder_ / "to/trials/a");
}

TEST_F(TrialFolders, AnIncompleteTrialDoesNotExist) {
  for (const char* text : {"", "{", "[]", "{\"id\": \"b\"}", "{\"id\": 1}",
                           "{\"id\": \"a\", \"status\": 3}", "{\"id\": \"a\", \"reason\": []}"}) {
    Write("trial.json", text);
    EXPECT_FALSE(ReadTrialFile(folder_ / "from", "a")) << text;
    ExpectNotTaken("trial.json");
  }
}

// Every byte of a trial.json counts, except blanks between its tokens and what follows its hash.
TEST_F(TrialFolders, EveryChangedByteOfATrialIsFound) {
  WriteTrial({{"id", "a"}, {"status", "done"}, {"result", {{"rms_mm", 1.25}, {"n", 2}}}});
  const std::string text = ReadFileBytes(From() / "trial.json");
  EXPECT_TRUE(Read().numbers);
  for (std::size_t k = 0; k < text.find("\"version\""); ++k) {
    if (text[k] != ' ' && text[k] != '\n') {
      std::string changed = text;
      changed[k] = text[k] == '7' ? '8' : '7';
      Write("trial.json", changed);
      EXPECT_THAT(Read().fault, HasSubstr("trial.json")) << changed;
    }
  }
}

TEST_F(TrialFolders, ResultsOfOtherTrialsAndOtherValuesAreFound) {
  const auto text = [](double value) {
    return TrialText({{"id", "a"}, {"status", "done"}, {"result", {{"rms_mm", value}}}},
                     Maker::kThisProgram);
  };
  for (const char* other : {"9.75", "null", "\"1.25\""}) {
    std::string changed = text(1.25);
    changed.replace(changed.find("1.25"), 4, other);
    Write("trial.json", changed);
    EXPECT_EQ(Read().fault, "trial.json is not what was written") << other;
  }
  Write("trial.json", TrialText({{"id", "b"}, {"status", "done"}}, Maker::kThisProgram));
  EXPECT_EQ(Read().fault, "trial.json is of another trial");
  // Another program may write the same members in another form.
  const nlohmann::ordered_json same = nlohmann::ordered_json::parse(text(1.25));
  Write("trial.json", same.dump(4));
  EXPECT_EQ(Read().fault, "");
}

TEST_F(TrialFolders, ATrialOfAnotherVersionIsSoundAndNamed) {
  EXPECT_TRUE(IsOfThisProgram(*Read().numbers));
  auto json = nlohmann::ordered_json::parse(ReadFileBytes(From() / "trial.json"));
  json["version"] = "0.0.1";
  Write("trial.json", json.dump(1));
  EXPECT_EQ(Read().numbers->version, "0.0.1");
  EXPECT_FALSE(IsOfThisProgram(*Read().numbers));
  EXPECT_EQ(TrialText(json, Maker::kAsBefore), json.dump(1) + "\n");
  json.erase("trial_sha256");  // as versions without a hash wrote it
  Write("trial.json", json.dump(1));
  EXPECT_TRUE(Read().numbers);
  json["version"] =
      nlohmann::ordered_json::parse(TrialText({{"id", "a"}}, Maker::kThisProgram))["version"];
  Write("trial.json", json.dump(1));
  EXPECT_EQ(Read().fault, "trial.json is not what was written");
}

TEST_F(TrialFolders, ACutFileIsFoundByItsSizeAlone) {
  Write("face.ply", "mes");
  EXPECT_EQ(Read(TrialCheck::kSizes).fault, "face.ply has 3 bytes instead of 4");
  Write("face.ply", "mesj");
  EXPECT_EQ(Read(TrialCheck::kSizes).fault, "");
  EXPECT_EQ(Read(TrialCheck::kAll).fault, "face.ply is not what was written");
}

TEST_F(TrialFolders, FilesOfABrokenTrialAreReplacedAndOtherFilesStay) {
  fs::create_directories(To());
  WriteFileAtomically(To() / "trial.json", "{");
  WriteFileAtomically(To() / "mine.txt", "mine");
  EXPECT_THAT(Copy(), IsEmpty());
  EXPECT_TRUE(ReadTrialFile(folder_ / "to", "a"));
  EXPECT_EQ(ReadFileBytes(To() / "mine.txt"), "mine");
}

TEST_F(TrialFolders, AFileThatIsNotAPlanIsAnError) {
  EXPECT_EQ(ReadPlanHash(folder_ / "from"), "");
  const fs::path file = folder_ / "from/plan.json";
  for (const char* text : {"", "{", "[]", "{}", "{\"hash\": 7}"}) {
    WriteFileAtomically(file, text);
    EXPECT_THROW(ReadPlanHash(folder_ / "from"), IoError) << text;
  }
  WriteFileAtomically(file, "{\"hash\": \"h\"}");
  EXPECT_EQ(ReadPlanHash(folder_ / "from"), "h");
}

// Collects the same numbers from a JSON tree.
void AddNumbers(const Json& json, const std::string& path, std::map<std::string, double>& numbers) {
  if (json.is_number()) {
    numbers[path] = json.get<double>();
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) {
      AddNumbers(value, path.empty() ? key : path + "." + key, numbers);
    }
  }
}

std::optional<TrialNumbers> Numbers(const std::string& text) {
  SharedNames names;
  return ReadTrialNumbers(text, names);
}

TEST(TrialNumbers, EqualThoseOfTheTree) {
  const std::string text = R"({"id": "a1", "status": "done", "axes": {"x": "1", "status": "no"},
    "result": {"n": 3, "low": -2, "null": null, "text": "x", "flag": true, "face":
    {"rms_mm": 1.5, "quantiles_mm": [0.5, null, 1e-3], "id": "b"},
    "fit": {"levels": [{"rms": 3, "deep": {"d": [7]}}, {"rms": 2}], "after": 1}, "last": 4e2},
    "files": [{"file": "a", "size": 4}], "after": 5})";
  const auto trial = Numbers(text);
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->id, "a1");
  EXPECT_EQ(trial->status, "done");
  std::map<std::string, double> numbers;
  AddNumbers(Json::parse(text)["result"], "", numbers);
  EXPECT_EQ((std::map<std::string, double>(trial->metrics.begin(), trial->metrics.end())), numbers);
  EXPECT_EQ(trial->metrics.size(), 5U);
  EXPECT_THAT(trial->lists,
              ElementsAre(Pair("face.quantiles_mm", ElementsAre(0.5, ::testing::IsNan(), 1e-3)),
                          Pair("fit.levels.deep.d", ElementsAre(7)),
                          Pair("fit.levels.rms", ElementsAre(3, 2))));
}

TEST(TrialNumbers, AgreeWithAJsonLibrary) {
  for (const char* value : {"1",      "-0",          "0.1",
                            "1e5",    "1E-5",        "-1.5e+300",
                            "1e-400", "4.9e-324",    "123456789012345678901",
                            "1e400",  "01",          "1.",
                            ".5",     "+1",          "-",
                            "1e",     "1e+",         "tru",
                            "nul",    "true",        "null",
                            "\"a\"",  "\"\\u00e9\"", "\"\\x\"",
                            "\"\t\"", "\"\xff\"",    "\"\xc3\xa9\"",
                            "[1, 2]", "[1 2]",       "[1,]",
                            "[,1]",   "{\"b\": 1}",  "{\"b\": 1,}",
                            "{b: 1}", "{\"b\" 1}",   "",
                            "1 2"}) {
    const std::string text = std::string(R"({"result": {"a": )") + value + "}}";
    EXPECT_EQ(Numbers(text).has_value(), Json::accept(text)) << text;
    if (const auto trial = Numbers(text); trial && trial->metrics.contains("a")) {
      EXPECT_EQ(trial->metrics.at("a"), Json::parse(text)["result"]["a"].get<double>()) << text;
    }
  }
}

TEST(TrialNumbers, OfOneKindShareTheirNames) {
  SharedNames names([](std::string_view name) { return name != "b"; });
  const auto first = ReadTrialNumbers(R"({"result": {"c": 1, "b": 2, "a": 3}})", names);
  const auto second = ReadTrialNumbers(R"({"result": {"c": 4, "b": 5, "a": 6}})", names);
  const auto other = ReadTrialNumbers(R"({"result": {"a": 7, "a": 8}})", names);
  EXPECT_EQ(first->metrics.names(), second->metrics.names());
  EXPECT_THAT(*first->metrics.names(), ElementsAre("a", "c"));
  EXPECT_EQ(second->metrics.at("a"), 6);
  EXPECT_EQ(other->metrics.at("a"), 8);
  EXPECT_EQ(other->metrics.size(), 1U);
}

TEST(TrialNumbers, HaveTheAxes) {
  const auto trial = Numbers(R"({"subject": "s", "axes": {"interp.type": "mean", "b": ""}})");
  EXPECT_EQ(trial->subject, "s");
  EXPECT_THAT(trial->axes, ElementsAre(Pair("interp.type", "mean"), Pair("b", "")));
}

TEST(TrialNumbers, AreMissingForATextThatIsNotATrial) {
  const std::string deep = R"({"id": "a", "result": )" + std::string(kDeepestJson, '[') +
                           std::string(kDeepestJson, ']') + "}";
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("3"), std::string("null"),
        std::string("\"id\""), std::string(R"({"id": "a")"), std::string(R"({"id": 1})"),
        std::string(R"({"id": null})"), std::string(R"({"status": ["done"]})"),
        std::string(R"({"status": {"a": 1}})"), std::string(R"({"reason": false})"), deep}) {
    EXPECT_FALSE(Numbers(text)) << text;
  }
  EXPECT_EQ(Numbers("{}")->status, "failed");
}

}  // namespace
}  // namespace semblance::problems
