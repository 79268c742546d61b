// SPDX-License-Identifier: GPL-3.0-or-later
// The strict reader and its exact messages; bases, overrides, resolved text, reference and schema.
#include "problems/config/config.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "problems/config/spelling_suggestion.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/random.h"
#include "tests/testing/config_samples.h"
#include "tests/testing/scratch_folder.h"
#include "tests/testing/shapes.h"

namespace semblance::problems {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using testing::Flat;
using testing::Mixed;
using testing::Options;
using testing::Thesis;

Options Read(const std::string& text) { return ReadConfigText<Options>(text, "/cfg/x.yaml"); }

// Returns the errors of a text.
std::string ErrorsOf(const std::string& text) {
  try {
    ReadConfigText<Options>(text, "x.yaml");
    return "no error";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

struct Wrong {
  std::string text;
  std::string error;
};

TEST(Config, MessagesAreExact) {
  const std::vector<Wrong> cases = {
      // Keys.
      {"radus_mm: 1", "x.yaml:1:1: radus_mm: unknown key; did you mean 'radius_mm'?"},
      {"radius: 1", "x.yaml:1:1: radius: unknown key; did you mean 'radius_mm'?"},
      {"last: {zzzzzz: 1}", "x.yaml:1:8: last.zzzzzz: unknown key; known are: level, fraction"},
      {"count: 1\nlabel: a\ncount: 2",
       "x.yaml:3:1: count: the key appears twice; first at line 1, column 1"},
      {"last:\n  level: 1\n  level: 2",
       "x.yaml:3:3: last.level: the key appears twice; first at line 2, column 3"},
      {"last:\n  <<: {level: 1}",
       "x.yaml:2:3: last.<<: merge keys (<<) are not read; repeat the entries or use base:"},
      {"[a, b]: 1", "x.yaml:1:1: a key must be a word"},
      // Anchors, aliases, tags, documents.
      {"count: &c 1",
       "x.yaml:1:8: count: anchors (&c) are not read; repeat the entries or use base:"},
      {"count: &c 1\nlast: {level: *c}",
       "x.yaml:1:8: count: anchors (&c) are not read; repeat the entries or use base:\n"
       "x.yaml:2:15: last.level: aliases (*) are not read; repeat the entries or use base:"},
      {"count: !!int 1", "x.yaml:1:8: count: tags (tag:yaml.org,2002:int) are not read; remove it"},
      {"last: !step {level: 1}", "x.yaml:1:7: last: tags (!step) are not read; remove it"},
      {"count: 1\n---\ncount: 2", "x.yaml:2:1: a second document begins here; a file holds one"},
      // Numbers.
      {"radius_mm: .nan", "x.yaml:1:12: radius_mm: '.nan' is not finite; expected a number"},
      {"radius_mm: -.Inf", "x.yaml:1:12: radius_mm: '-.Inf' is not finite; expected a number"},
      {"radius_mm: NaN", "x.yaml:1:12: radius_mm: 'NaN' is not finite; expected a number"},
      {"radius_mm: 1e999",
       "x.yaml:1:12: radius_mm: 1e999 does not fit; expected a number between 1e-308 and 1e308 "
       "in size"},
      {"radius_mm: 010.5",
       "x.yaml:1:12: radius_mm: '010.5' is not a plain decimal; write a number without a leading "
       "0"},
      {"count: 010",
       "x.yaml:1:8: count: '010' is not a plain decimal; write a whole number without a leading 0"},
      {"count: 0o17",
       "x.yaml:1:8: count: '0o17' is not a plain decimal; write a whole number without a leading "
       "0"},
      {"count: 0x1F",
       "x.yaml:1:8: count: '0x1F' is not a plain decimal; write a whole number without a leading "
       "0"},
      {"radius_mm: \"2.5\"",
       "x.yaml:1:12: radius_mm: expected a number, found the text \"2.5\"; remove the quotes"},
      {"radius_mm: 'wide'", "x.yaml:1:12: radius_mm: expected a number, found the text \"wide\""},
      {"radius_mm: wide", "x.yaml:1:12: radius_mm: expected a number, found 'wide'"},
      {"radius_mm: 2,5",
       "x.yaml:1:12: radius_mm: expected a number, found '2,5'; the decimal sign is a point"},
      {"radius_mm: 2.5 mm", "x.yaml:1:12: radius_mm: expected a number, found '2.5 mm'"},
      {"radius_mm: 12", "x.yaml:1:12: radius_mm: 12 is out of range; allowed is 0 to 10 mm"},
      {"limit: -1", "x.yaml:1:8: limit: -1 is out of range; allowed is at least 0"},
      {"count: 0", "x.yaml:1:8: count: 0 is out of range; allowed is 1 to 100"},
      {"count: 1.5", "x.yaml:1:8: count: expected a whole number, found 1.5; write only digits"},
      {"count: 1e1", "x.yaml:1:8: count: expected a whole number, found 1e1; write only digits"},
      {"count: three", "x.yaml:1:8: count: expected a whole number, found 'three'"},
      {"count: +-3", "x.yaml:1:8: count: expected a whole number, found '+-3'"},
      {"count: 2147483648",
       "x.yaml:1:8: count: 2147483648 does not fit; allowed is -2147483648 to 2147483647"},
      {"random_seed: 18446744073709551616",
       "x.yaml:1:14: random_seed: 18446744073709551616 does not fit; allowed is 0 to "
       "18446744073709551615"},
      {"random_seed: -1",
       "x.yaml:1:14: random_seed: -1 does not fit; allowed is 0 to 18446744073709551615"},
      // Texts that continue on the next line.
      {"label: \"a\ncount: 3\"",
       "x.yaml:1:8: label: the quote that begins here is not closed in its line; close it (write "
       "a text of several lines as a block, after |, or indent its next lines deeper)"},
      {"label: 'it''s\ncount: 3'",
       "x.yaml:1:8: label: the quote that begins here is not closed in its line; close it (write "
       "a text of several lines as a block, after |, or indent its next lines deeper)"},
      {"values:\n  a: 1\nlabel: \"a\n  b\n count: 3\nradius_mm: 2\"",
       "x.yaml:3:8: label: the quote that begins here is not closed in its line; close it "
       "(write a text of several lines as a block, after |, or indent its next lines deeper)"},
      {"{label: a\n  b}",
       "x.yaml:1:9: label: a text within brackets continues on the next line; is a comma or a "
       "bracket missing?"},
      // Kinds.
      {"radius_mm: {a: 1}", "x.yaml:1:12: radius_mm: expected a number, found a map"},
      {"radius_mm: [1]", "x.yaml:1:12: radius_mm: expected a number, found a list"},
      {"label: [1]", "x.yaml:1:8: label: expected a text, found a list"},
      {"last: 3", "x.yaml:1:7: last: expected a map, found '3'"},
      {"schedule: {level: 1}", "x.yaml:1:11: schedule: expected a list, found a map"},
      {"schedule: []", "x.yaml:1:11: schedule: expected a list of at least 1, found 0"},
      {"center_mm: [1, 2]", "x.yaml:1:12: center_mm: expected a list of 3, found 2"},
      {"center_mm: [1, 2, x]", "x.yaml:1:19: center_mm[2]: expected a number, found 'x'"},
      {"skull: ~/a.ply", "x.yaml:1:8: skull: '~/a.ply': ~ is not expanded; write the whole path"},
      {"skull: \"a.ply\\0.obj\"",
       "x.yaml:1:8: skull: a path cannot have the character NUL (\\0); leave it out"},
      {"- 1\n- 2", "x.yaml:1:1: expected a map of options at the top, found a list"},
      {"hello", "x.yaml:1:1: expected a map of options at the top, found a scalar"},
      // true and false.
      {"verbose: yes", "x.yaml:1:10: verbose: expected true or false, found 'yes'"},
      {"verbose: off", "x.yaml:1:10: verbose: expected true or false, found 'off'"},
      {"verbose: True", "x.yaml:1:10: verbose: expected true or false, found 'True'"},
      {"verbose: \"true\"",
       "x.yaml:1:10: verbose: expected true or false, found the text \"true\""},
      {"verbose: 1", "x.yaml:1:10: verbose: expected true or false, found '1'"},
      // Null has the location of its key.
      {"count: null", "x.yaml:1:1: count: expected a whole number, found nothing (null)"},
      {"count:\nlabel: a", "x.yaml:1:1: count: expected a whole number, found nothing (null)"},
      {"label: ~", "x.yaml:1:1: label: expected a text, found nothing (null)"},
      {"last:", "x.yaml:1:1: last: expected a map, found nothing (null)"},
      {"schedule:\n  - ~\n  - {level: 1}",
       "x.yaml:2:5: schedule[0]: expected a map, found nothing (null)"},
      // Words and types.
      {"sex: femal",
       "x.yaml:1:6: sex: unknown word 'femal'; known are: male, female; did you mean 'female'?"},
      {"sex: [male]", "x.yaml:1:6: sex: expected a word, found a list; known are: male, female"},
      {"emitter: flatt",
       "x.yaml:1:10: emitter: unknown type 'flatt'; known are: thesis, flat, mixed; did you mean "
       "'flat'?"},
      {"emitter: {type: other, decay: 2}",
       "x.yaml:1:17: emitter.type: unknown type 'other'; known are: thesis, flat, mixed"},
      {"emitter: {type: thesis, rings: 2}",
       "x.yaml:1:25: emitter.rings: unknown key; known are: decay, type"},
      {"emitter: {type: mixed, parts: [{decay: 3}]}",
       "x.yaml:1:32: emitter.parts[0]: 'type' is missing; known are: thesis, flat"},
      {"last: {level: 0, fraction: 1}",
       "x.yaml:1:28: last.fraction: level 0 may not be fitted wholly; use less than 1"},
      {"values: {a: -1}", "x.yaml:1:13: values.a: -1 is out of range; allowed is at least 0 mm"},
      // Bytes and syntax.
      {"last:\n\tlevel: 1", "x.yaml:2:1: a tab; use spaces (in a text, write \"\\t\")"},
      {"label: a\x01", "x.yaml:1:9: a control character; remove it"},
      {"label: \xff", "x.yaml:1:8: a byte that is not UTF-8; save the file as UTF-8"},
      {"label: \xed\xa0\x80",  // half of a pair of UTF-16
       "x.yaml:1:8: a byte that is not UTF-8; save the file as UTF-8"},
      {"label: \xe0\x80\x80",  // longer than needed
       "x.yaml:1:8: a byte that is not UTF-8; save the file as UTF-8"},
      {"label: \xf0\x80\x80\x80", "x.yaml:1:8: a byte that is not UTF-8; save the file as UTF-8"},
      {"label: \xf4\x90\x80\x80",  // above U+10FFFF
       "x.yaml:1:8: a byte that is not UTF-8; save the file as UTF-8"},
      {"last: {level: 1", "x.yaml:1:16: this is not YAML: end of map flow not found"},
      {"count: 1: 2", "x.yaml:1:9: this is not YAML: illegal map value"},
  };
  for (const Wrong& wrong : cases) {
    EXPECT_EQ(ErrorsOf(wrong.text), wrong.error) << wrong.text;
  }
}

TEST(Config, AllOfUnicodeIsReadAndTextsOfSeveralLinesAreBlocks) {
  for (const char* const text : {"\xed\x9f\xbf", "\xee\x80\x80", "\xe0\xa0\x80", "\xf0\x90\x80\x80",
                                 "\xf4\x8f\xbf\xbf", "it's \"so\"", "a # b"}) {
    EXPECT_EQ(Read(fmt::format("label: |-\n  {}\n", text)).label, text);
  }
  EXPECT_EQ(Read("label: |\n  \"a\n  'b\n").label, "\"a\n'b\n");
  EXPECT_EQ(Read("\xEF\xBB\xBFlabel: \"a \\\" b\"\n").label, "a \" b");
  EXPECT_EQ(Read("label: 'it''s'\n").label, "it's");
  EXPECT_EQ(Read("label: one\n  and two\n").label, "one and two");
}

// PyYAML folds texts after 80 columns. These are its own words for the text.
TEST(Config, FoldedTextsAreReadAsPyYamlWritesThem) {
  const std::string text =
      "It's a long text with words, and: colons, so that it needs quotes, which go on beyond "
      "eighty "
      "columns for sure, and on";
  EXPECT_EQ(
      Read("label: 'It''s a long text with words, and: colons, so that it needs quotes, which\n"
           "  go on beyond eighty columns for sure, and on'\ncount: 3\n")
          .label,
      text);
  const Options options = Read(
      "tags:\n- 'It''s a long text with words, and: colons, so that it needs quotes, which go on\n"
      "  beyond eighty columns for sure, and on'\n- x\n"
      "label: \"\\xE9 It's a long text with words, and: colons, so that it needs quotes, which\\\n"
      "  \\ go on beyond eighty columns for sure, and on \\xFC\\e \\\\ \\\"x\\\"\"\n");
  EXPECT_EQ(options.tags, (std::vector<std::string>{text, "x"}));
  EXPECT_EQ(options.label, "\u00e9 " + text + " \u00fc\x1b \\ \"x\"");
  EXPECT_EQ(Read("label: 'one\n\n  two\n\n\n  three it''s: x '\n").label,
            "one\ntwo\n\nthree it's: x ");
  EXPECT_EQ(Read("{count: 3, label: \"a\n  b\"}\n").label, "a b");
  EXPECT_EQ(
      Read("tags: [Its a long text with words and colons so that it needs quotes which go on "
           "beyond\n    eighty columns for sure and on, x]\n")
          .tags,
      (std::vector<std::string>{"Its a long text with words and colons so that it needs quotes "
                                "which go on beyond eighty columns for sure and on",
                                "x"}));
}

TEST(Config, PlacesAfterAFoldedTextAreRight) {
  EXPECT_EQ(ErrorsOf("label: \"a\n  b\n\n  c\"\ncount: x\nlast: {level: y}\n"),
            "x.yaml:5:8: count: expected a whole number, found 'x'\n"
            "x.yaml:6:15: last.level: expected a whole number, found 'y'");
  EXPECT_EQ(ErrorsOf("tags:\n- 'a\n  b'\n- c\ncount: x\n"),
            "x.yaml:5:8: count: expected a whole number, found 'x'");
}

// "\u00fc" is one character or two; a keyboard writes one and a Mac's file system two.
TEST(Config, TextsAndKeysThatAreTheSameInUnicodeAreTheSame) {
  const std::string composed = "M\u00fcller", decomposed = "Mu\u0308ller";
  EXPECT_EQ(Read("label: " + decomposed).label, composed);
  EXPECT_EQ(Read("tags: [\"" + decomposed + "\"]").tags, std::vector<std::string>{composed});
  EXPECT_EQ(Read("values: {" + decomposed + ": 1}").values.count(composed), 1U);
  EXPECT_EQ(
      ErrorsOf("values: {" + decomposed + ": 1, " + composed + ": 2}"),
      "x.yaml:1:23: values." + composed + ": the key appears twice; first at line 1, column 10");
  const testing::ScratchFolder folder;
  WriteFileAtomically(folder / (decomposed + ".ply"), "ply");
  WriteFileAtomically(folder / "x.yaml", "skull: " + composed + ".ply\n");
  EXPECT_EQ(ReadConfig<Options>(folder / "x.yaml").skull, folder / (decomposed + ".ply"));
}

TEST(Config, WrittenYamlHasNoControlCharactersAndReadsBack) {
  Options options;
  options.label = "a\x1b[31m \u009b \u202e \u2028 \u00e9\x7f";
  const std::string yaml = WriteConfig(options);
  EXPECT_THAT(yaml, HasSubstr(R"(label: "a\x1B[31m \x9B \u202E \u2028 é\x7F")"));
  EXPECT_EQ(Read(yaml).label, options.label);
}

TEST(ConfigTree, SetsEntryFollowsThePathIntoTheValue) {
  ConfigErrors errors;
  const auto sets = [&](const char* path, const char* value, const char* inner) {
    return SetsEntry(path, ParseConfigText(value, {.name = "x", .folder = "/"}, errors), inner);
  };
  EXPECT_TRUE(sets("a.b", "3", "a.b"));
  EXPECT_TRUE(sets("a", "{b: 3}", "a.b"));
  EXPECT_TRUE(sets("a", "{b: [1, {c: 2}]}", "a.b[1].c"));
  EXPECT_TRUE(sets("a", "null", "a.b"));
  EXPECT_TRUE(sets("a", "name", "a.type"));
  EXPECT_FALSE(sets("a", "name", "a.b"));
  EXPECT_FALSE(sets("a", "{b: 3}", "a.c"));
  EXPECT_FALSE(sets("a", "{b: 3}", "ab"));
  EXPECT_FALSE(sets("a.b", "3", "a"));
  EXPECT_FALSE(sets("a", "[1]", "a[1]"));
  EXPECT_EQ(CanonicalPath("a.b[00].c"), "a.b[0].c");
  EXPECT_THROW(CanonicalPath("a..b"), ConfigError);
}

TEST(Config, ABaseOfANameThatNoFileCanHaveIsAnErrorLikeOthers) {
  EXPECT_THAT(ErrorsOf("base: " + std::string(3000, 'a')), HasSubstr("x.yaml:1:7: base: "));
}

TEST(Config, WhatIsTooDeepOrTooLargeIsRefusedBeforeItIsFollowed) {
  const auto nested = [](std::size_t levels) {
    return "label: " + std::string(levels, '[') + std::string(levels, ']');
  };
  EXPECT_THAT(ErrorsOf(nested(63)), Not(HasSubstr("levels")));
  for (const std::size_t levels : {64, 400, 100000}) {
    EXPECT_THAT(ErrorsOf(nested(levels)),
                HasSubstr("more than 64 levels of nested maps and lists"));
  }
  std::string keys;
  for (int k = 0; k <= 10'000; ++k) {
    keys += fmt::format("k{}: 1\n", k);
  }
  EXPECT_THAT(ErrorsOf(keys),
              HasSubstr("x.yaml:10001:1: this is not YAML: more than 10000 entries"));
  EXPECT_THAT(ErrorsOf("# " + std::string(16'000'000, 'x')), HasSubstr("at most 16 MB are read"));
  std::string path = "a";
  for (int k = 0; k < 100000; ++k) {
    path += ".a";
  }
  ConfigNode tree = ConfigNode::Map();
  EXPECT_THROW(SetPath(tree, path, ConfigNode::Scalar("1")), ConfigError);
}

TEST(Config, ReportsAllErrorsInTheOrderOfLines) {
  EXPECT_EQ(ErrorsOf("tagz: []\nlabel: ok\nverbose: no\ncount: x"),
            "x.yaml:1:1: tagz: unknown key; did you mean 'tags'?\n"
            "x.yaml:3:10: verbose: expected true or false, found 'no'\n"
            "x.yaml:4:8: count: expected a whole number, found 'x'");
}

TEST(Config, AnEmptyFileIsAllDefaults) {
  for (const char* text : {"", "\n", "# only a comment\n", "---\n", "{}", "# a\ttab\n"}) {
    EXPECT_EQ(Read(text), Options{}) << text;
  }
}

TEST(Config, ReadsEveryKindOfField) {
  const Options options = Read(
      "verbose: true\ncount: +7\nrandom_seed: 18446744073709551615\nradius_mm: 1e-3\n"
      "label: \"010\"\nskull: ../data/skull.ply\ncenter_mm: [1, -2.5, .5]\nsex: female\n"
      "limit: 4\nschedule:\n  - {level: 2, fraction: 1}\n"
      "values: {normal_male: 4.25, obese_male: null}\n"
      "emitter: {type: mixed, parts: [thesis, {type: flat, rings: 4}], rest: {rings: 9}}\n"
      "last: {level: 3}\ntags: [a, 'b c']\r\n");
  Options due;
  due.verbose = true;
  due.count = 7;
  due.random_seed = 18446744073709551615u;
  due.radius_mm = 1e-3;
  due.label = "010";
  due.skull = "/data/skull.ply";
  due.center_mm = {1, -2.5, 0.5};
  due.sex = testing::Sex::kFemale;
  due.limit = 4;
  due.schedule = {{2, 1}};
  due.values = {{"normal_male", 4.25}, {"obese_male", std::nullopt}};
  due.emitter = Mixed{.parts = {Thesis{}, Flat{.rings = 4}}, .rest = Flat{.rings = 9}};
  due.last.level = 3;
  due.tags = {"a", "b c"};
  EXPECT_EQ(options, due);
}

TEST(Config, AMapWithoutTypeSetsTheDefaultType) {
  EXPECT_EQ(std::get<Flat>(Read("emitter: {rings: 5}").emitter).rings, 5);
  EXPECT_EQ(std::get<Thesis>(Read("emitter: thesis").emitter), Thesis{});
}

TEST(Config, OptionalFieldsTakeNull) {
  for (const char* text : {"limit: null", "limit: ~", "limit:"}) {
    EXPECT_EQ(Read(text).limit, std::nullopt) << text;
  }
}

TEST(Config, AMissingFileIsAnIoError) {
  EXPECT_THROW(ReadConfig<Options>("no/such/file.yaml"), IoError);
  EXPECT_THROW(ReadConfig<Options>(SEMBLANCE_SOURCE_DIR), IoError);
}

// The expected distances were counted by hand.
TEST(NearestWord, CountsEditsAndSwaps) {
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
  EXPECT_EQ(EditDistance("fiel", "file"), 1);
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("Decay", "decay"), 0);
  const std::vector<std::string> known = {"thesis", "split", "flat"};
  EXPECT_EQ(NearestWord("splt", known), "split");
  EXPECT_EQ(NearestWord("voronoi", known), "");
  EXPECT_EQ(NearestWord(std::string(100'000'000, 's'), known),
            "");  // must not allocate by the length
}

// Simulates a run's folder on another machine: the inputs lie beside resolved.yaml.
TEST(Config, AnAbsolutePathThatDoesNotExistIsAFileBesideThisOne) {
  const testing::ScratchFolder folder;
  const std::filesystem::path file = folder / "resolved.yaml";
  const auto skull = [&](const std::filesystem::path& named) {
    WriteFileAtomically(file, fmt::format("skull: {}\n", named.string()));
    return ReadConfig<Options>(file).skull;
  };
  EXPECT_EQ(skull("/elsewhere/heads/skull.ply"), "/elsewhere/heads/skull.ply");
  WriteFileAtomically(folder / "skull.ply", "ply");
  EXPECT_EQ(skull("/elsewhere/heads/skull.ply"), folder / "skull.ply");
  // An existing file and a relative path are taken as written.
  std::filesystem::create_directories(folder / "heads");
  EXPECT_EQ(skull("heads/skull.ply"), folder / "heads/skull.ply");
  WriteFileAtomically(folder / "heads/skull.ply", "ply");
  EXPECT_EQ(skull(folder / "heads/skull.ply"), folder / "heads/skull.ply");
}

// A folder of small files that is removed after the test.
class ConfigFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(::testing::TempDir()) / (std::string("config_") + info->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "sub");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string ErrorsOf(const std::filesystem::path& file) {
    try {
      ReadConfig<Options>(file);
      return "no error";
    } catch (const ConfigError& error) {
      return error.what();
    }
  }
  std::filesystem::path folder_;
};

Options Set(const std::string& text, const std::vector<std::string>& overrides) {
  return ReadConfigText<Options>(text, "x.yaml", overrides);
}

std::string SetErrors(const std::string& text, const std::vector<std::string>& overrides) {
  try {
    Set(text, overrides);
    return "no error";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST_F(ConfigFiles, AFileIsMergedOverItsBaseKeyByKey) {
  Write("sub/grand.yaml", "label: grand\ncount: 9\nskull: g.ply\n");
  Write("sub/base.yaml",
        "base: grand.yaml\nlast: {level: 2, fraction: 0.25}\nschedule: [{level: 5}, {level: 6}]\n"
        "emitter: {type: flat, rings: 7}\nvalues: {a: 1, b: 2}\n");
  const auto file = Write("top.yaml",
                          "base: sub/base.yaml\nlast: {level: 3}\nschedule: [{level: 1}]\n"
                          "label: top\nemitter: {rings: 8}\nvalues: {b: null, c: 3}\n");
  const Options options = ReadConfig<Options>(file);
  EXPECT_EQ(options.label, "top");
  EXPECT_EQ(options.count, 9);
  EXPECT_EQ(options.skull, folder_ / "sub" / "g.ply");  // relative to the file that names it
  EXPECT_EQ(options.last, (testing::Step{3, 0.25}));
  EXPECT_EQ(options.schedule, (std::vector<testing::Step>{{1, 0.4}}));
  EXPECT_EQ(std::get<Flat>(options.emitter).rings, 8);
  EXPECT_EQ(options.values, (std::map<std::string, std::optional<double>>{
                                {"a", 1.0}, {"b", std::nullopt}, {"c", 3.0}}));
}

TEST_F(ConfigFiles, EachBaseIsMergedOverThoseBeforeIt) {
  Write("sub/shared.yaml", "count: 9\n");
  Write("sub/first.yaml", "base: shared.yaml\nlabel: first\nskull: f.ply\nemitter: flat\n");
  Write("second.yaml", "base: sub/shared.yaml\nlabel: second\nemitter: {type: thesis, decay: 3}\n");
  const Options options = ReadConfig<Options>(
      Write("top.yaml", "base: [sub/first.yaml, second.yaml]\nlast: {level: 3}\n"));
  EXPECT_EQ(options.label, "second");
  EXPECT_EQ(options.count, 9);  // both have the same base
  EXPECT_EQ(options.skull, folder_ / "sub" / "f.ply");
  EXPECT_EQ(options.emitter, decltype(Options::emitter)(Thesis{3}));
  EXPECT_EQ(options.last.level, 3);
}

// Each file names the next file twice, which would be 2^70 files.
TEST_F(ConfigFiles, TheNumberOfBasesIsLimited) {
  for (int k = 0; k < 70; ++k) {
    Write(fmt::format("{}.yaml", k), fmt::format("base: [{0}.yaml, {0}.yaml]\n", k + 1));
  }
  Write("70.yaml", "count: 1\n");
  EXPECT_THAT(ErrorsOf(folder_ / "0.yaml"),
              HasSubstr("base: more than 64 bases, including bases of bases"));
}

TEST_F(ConfigFiles, AnotherTypeReplacesAVariantWholly) {
  Write("base.yaml", "emitter: {type: flat, rings: 7}\n");
  const auto other = Write("other.yaml", "base: base.yaml\nemitter: {type: thesis}\n");
  EXPECT_EQ(ReadConfig<Options>(other).emitter, (decltype(Options::emitter){Thesis{}}));
  const auto same = Write("same.yaml", "base: base.yaml\nemitter: {type: flat}\n");
  EXPECT_EQ(std::get<Flat>(ReadConfig<Options>(same).emitter).rings, 7);
  const auto bare = Write("bare.yaml", "base: base.yaml\nemitter: flat\n");
  EXPECT_EQ(std::get<Flat>(ReadConfig<Options>(bare).emitter).rings, 2);
  Write("name.yaml", "emitter: thesis\n");
  const auto more = Write("more.yaml", "base: name.yaml\nemitter: {decay: 9}\n");
  EXPECT_EQ(std::get<Thesis>(ReadConfig<Options>(more).emitter).decay, 9);
}

TEST_F(ConfigFiles, BadBasesAreErrorsWithTheirLocation) {
  const auto a = Write("a.yaml", "base: b.yaml\n");
  Write("b.yaml", "base: a.yaml\n");
  EXPECT_EQ(ErrorsOf(a),
            (folder_ / "b.yaml").string() + ":1:7: base: 'a.yaml' would be its own base");
  const auto lost = Write("lost.yaml", "count: 0\nbase: none.yaml\n");
  EXPECT_EQ(ErrorsOf(lost), lost.string() +
                                ":1:8: count: 0 is out of range; allowed is 1 to 100\n" +
                                lost.string() + ":2:7: base: " + (folder_ / "none.yaml").string() +
                                ": no such file; paths are relative to this file");
  for (const char* no_file : {"base: []\n", "base: {a: b}\n", "base: [[a]]\n", "base: [\"\"]\n"}) {
    EXPECT_THAT(ErrorsOf(Write("list.yaml", no_file)), HasSubstr("expected the path of a file"));
  }
  EXPECT_THAT(
      ErrorsOf(Write("list.yaml", "base: [lost.yaml, other.yaml]\n")),
      HasSubstr("list.yaml:1:19: base: " + (folder_ / "other.yaml").string() + ": no such"));
  Write("wrong.yaml", "count: x\n");
  EXPECT_EQ(ErrorsOf(Write("over.yaml", "base: wrong.yaml\n")),
            (folder_ / "wrong.yaml").string() + ":1:8: count: expected a whole number, found 'x'");
}

TEST(ConfigSet, SetsEntriesOfMapsListsAndVariants) {
  EXPECT_EQ(Set("", {"count=5"}).count, 5);
  EXPECT_EQ(Set("last: {fraction: 0.5}", {"last.level=4"}).last, (testing::Step{4, 0.5}));
  EXPECT_EQ(Set("", {"schedule[1].fraction=0.9"}).schedule,
            (std::vector<testing::Step>{{0, 0.4}, {1, 0.9}}));  // of the default list
  EXPECT_EQ(Set("schedule: [{level: 2}]", {"schedule[0].fraction=0.9"}).schedule,
            (std::vector<testing::Step>{{2, 0.9}}));
  EXPECT_EQ(Set("", {"schedule=[{level: 6}]"}).schedule.size(), 1u);
  EXPECT_EQ(std::get<Flat>(Set("", {"emitter.rings=4"}).emitter).rings, 4);
  EXPECT_EQ(std::get<Thesis>(Set("emitter: thesis", {"emitter.decay=4"}).emitter).decay, 4);
  EXPECT_EQ(std::get<Thesis>(Set("emitter: {rings: 3}", {"emitter=thesis"}).emitter), Thesis{});
  const Options mixed = Set("", {"emitter=mixed", "emitter.rest={type: thesis, decay: 2}"});
  EXPECT_EQ(std::get<Mixed>(mixed.emitter).rest, testing::Emitter{Thesis{.decay = 2}});
  EXPECT_EQ(Set("values: {a: 1}", {"values.b=null"}).values.size(), 2u);
  EXPECT_EQ(Set("limit: 4", {"limit="}).limit, std::nullopt);
  EXPECT_EQ(Set("", {"count=5", "count=6"}).count, 6);
}

TEST(ConfigSet, AnotherTypeDropsTheOptionsOfLowerLayers) {
  const auto thesis = [](double decay) { return decltype(Options::emitter)(Thesis{decay}); };
  EXPECT_EQ(Set("", {"emitter.type=thesis"}).emitter, thesis(6));  // the default is flat
  EXPECT_EQ(Set("emitter: {type: flat, rings: 7}", {"emitter.type=thesis"}).emitter, thesis(6));
  EXPECT_EQ(Set("emitter: {rings: 7}", {"emitter.type=thesis"}).emitter, thesis(6));
  EXPECT_EQ(Set("emitter: flat", {"emitter.type=thesis", "emitter.decay=4"}).emitter, thesis(4));
  EXPECT_EQ(std::get<Flat>(Set("emitter: {rings: 7}", {"emitter.type=flat"}).emitter).rings, 7);
  const std::string mixed = "emitter: {type: mixed, rest: {type: flat, rings: 4}}";
  EXPECT_EQ(Set(mixed, {"emitter.type=thesis", "emitter.decay=3"}).emitter, thesis(3));
}

TEST(ConfigSet, AnotherTypeRefusesOptionsOfTheFormerTypeInTheSameLayer) {
  const auto refused = HasSubstr("--set emitter.rings=4: emitter.rings: unknown key");
  EXPECT_THAT(SetErrors("", {"emitter.rings=4", "emitter.type=thesis"}), refused);
  EXPECT_THAT(SetErrors("emitter: {rings: 7}", {"emitter.type=thesis", "emitter.rings=4"}),
              refused);
}

TEST(ConfigSet, PathsAreRelativeToTheCurrentFolder) {
  EXPECT_EQ(
      ReadConfigText<Options>("", "/far/x.yaml", std::vector<std::string>{"skull=s.ply"}).skull,
      std::filesystem::current_path() / "s.ply");
}

TEST(ConfigSet, ErrorsNameTheOverride) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"count=0", "--set count=0: count: 0 is out of range; allowed is 1 to 100"},
      {"cuont=2", "--set cuont=2: cuont: unknown key; did you mean 'count'?"},
      {"lst.level=2", "--set lst.level=2: lst: unknown key; did you mean 'last'?"},
      {"last.levl=2", "--set last.levl=2: last.levl: unknown key; did you mean 'level'?"},
      {"count", "--set count: an override is written as path=value"},
      {"count=", "--set count=: count: expected a whole number, found nothing (null)"},
      {"=3", "--set =3: : not a path; write it like a.b[0].c"},
      {"a..b=3", "--set a..b=3: a..b: not a path; write it like a.b[0].c"},
      {"schedule[x]=3", "--set schedule[x]=3: schedule[x]: not a path; write it like a.b[0].c"},
      {"schedule[2].level=3",
       "--set schedule[2].level=3: schedule[2]: past the end; the list has 2 items, counted from "
       "0"},
      {"schedule.level=3",
       "--set schedule.level=3: schedule.level: this is an entry of a list; write its index, like "
       "[0]"},
      {"count[0]=3", "--set count[0]=3: count[0]: an index needs a list, and there is none"},
      {"tags=[a", "--set tags=[a: this is not YAML: end of sequence flow not found"},
      {"emitter.decay=3",
       "--set emitter.decay=3: emitter.decay: unknown key; known are: rings, type"},
  };
  for (const auto& [text, error] : cases) {
    EXPECT_EQ(SetErrors("", {text}), error);
  }
  EXPECT_EQ(SetErrors("label: [1]", {"count=0"}),
            "x.yaml:1:8: label: expected a text, found a list\n"
            "--set count=0: count: 0 is out of range; allowed is 1 to 100");
}

// Random values: doubles of all magnitudes, and texts of all bytes that YAML can hold.
Options RandomOptions(Random& random) {
  const auto number = [&] {
    return std::ldexp(random.Uniform(-1, 1), int(random.Uniform(-1070, 1020)));
  };
  Options options;
  options.verbose = random.Uniform(0, 1) < 0.5;
  options.count = static_cast<int>(random.Uniform(1, 100));
  options.random_seed = std::bit_cast<std::uint64_t>(random.Uniform(0, 1)) * 7919;
  options.radius_mm = random.Uniform(0, 10);
  for (int i = 0; i < 8; ++i) {
    options.label += static_cast<char>(random.Uniform(1, 127));
  }
  options.center_mm = {number(), number(), -0.0};
  options.sex = random.Uniform(0, 1) < 0.5 ? testing::Sex::kMale : testing::Sex::kFemale;
  options.schedule.assign(3, {2, random.Uniform(0, 1)});
  options.values = {{options.label, random.Uniform(0, 9)}, {"no", std::nullopt}, {"", 0.0}};
  options.emitter = Mixed{.parts = {Flat{.rings = 5}, Thesis{.decay = random.Uniform(1, 9)}},
                          .rest = Thesis{.decay = random.Uniform(1, 9)}};
  options.tags = {"null", "yes", "~", "", " a ", "- b", "c: d", "# e", "1e3", "\xC3\xA4", "{", "'"};
  return options;
}

TEST(ConfigWrite, ResolvedTextGivesTheSameValueAndTheSameText) {
  Random random(20241);
  for (int i = 0; i < 200; ++i) {
    const Options options = RandomOptions(random);
    const std::string text = WriteConfig(options);
    const Options again = ReadConfigText<Options>(text, "x.yaml");
    ASSERT_EQ(again, options) << text;
    EXPECT_EQ(std::bit_cast<std::uint64_t>(again.center_mm[2]), std::bit_cast<std::uint64_t>(-0.0));
    EXPECT_EQ(WriteConfig(again), text);
  }
  EXPECT_EQ(ReadConfigText<Options>(WriteConfig(Options{}), "x.yaml"), Options{});
}

TEST(ConfigWrite, IsReadableAndExplicit) {
  Options options;
  options.skull = "/data/skull.ply";
  EXPECT_EQ(WriteConfig(options),
            "verbose: false\ncount: 3\nrandom_seed: 1\nradius_mm: 2.5\nlabel: one\n"
            "skull: /data/skull.ply\ncenter_mm: [0, 0, 0]\nsex: male\nlimit: null\nschedule:\n"
            "  - level: 0\n    fraction: 0.4\n  - level: 1\n    fraction: 0.35\nvalues: {}\n"
            "emitter:\n  type: flat\n  rings: 2\nlast:\n  level: 0\n  fraction: 0.4\ntags: []\n");
}

TEST(ConfigWrite, RefusesNumbersThatAreNotFinite) {
  Options options;
  options.center_mm[1] = std::nan("");
  try {
    WriteConfig(options);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "center_mm[1]: nan cannot be written to a configuration; only finite "
                 "numbers can");
  }
}

TEST(ConfigTree, SetPathSetsWholeTreesAndChangesNothingOnFailure) {
  ConfigNode tree = ConfigNode::Map();
  SetPath(tree, "a.b", ConfigNode::Scalar("1"));
  ConfigNode more = ConfigNode::Map();
  more.Set("c", ConfigNode::Scalar("2"));
  SetPath(tree, "a", more);
  EXPECT_EQ(ToFlowYaml(tree), "{a: {b: 1, c: 2}}");
  EXPECT_THROW(SetPath(tree, "x.y[0]", more), ConfigError);
  EXPECT_EQ(ToFlowYaml(tree), "{a: {b: 1, c: 2}}");
}

TEST(OptionsReference, HasTypeDefaultRangeUnitAndMeaning) {
  const std::string text = OptionsReference<Options>();
  EXPECT_THAT(text, HasSubstr("radius_mm: number, default 2.5, 0 to 10 mm\n    of the sphere\n"));
  EXPECT_THAT(text, HasSubstr("sex: one of male, female, default male\n"));
  EXPECT_THAT(text, HasSubstr("emitter: type, one of thesis, flat, mixed, default flat\n"));
  EXPECT_THAT(text, HasSubstr("emitter.decay (type: thesis): number, default 6, 0.5 to 50\n"));
  EXPECT_THAT(text, HasSubstr("schedule: list: map, default [{level: 0, fraction: 0.4}, {level: 1, "
                              "fraction: 0.35}], at least 1 of them\n"));
  EXPECT_THAT(text, HasSubstr("schedule[].level: whole number, default 0, 0 to 6\n"));
  EXPECT_THAT(text, HasSubstr("values: map by name: number or null, default {}, at least 0 mm\n"));
  EXPECT_THAT(text, HasSubstr("emitter.parts[].rings (type: mixed) (type: flat): whole number"));
}

// A struct that gives its parts other defaults than their own.
struct Outer {
  testing::Step step = {.level = 3};
  testing::Emitter emitter = Thesis{.decay = 9};
};
template <class Visitor>
void Fields(Visitor& visit, Outer& o) {
  visit(FieldInfo{.name = "step"}, o.step);
  visit(FieldInfo{.name = "emitter"}, o.emitter);
}

TEST(OptionsReference, HasTheDefaultsOfTheSurroundingStruct) {
  const std::string text = OptionsReference<Outer>();
  EXPECT_THAT(text, HasSubstr("step.level: whole number, default 3, 0 to 6\n"));
  EXPECT_THAT(text, HasSubstr("emitter.decay (type: thesis): number, default 9, 0.5 to 50\n"));
  EXPECT_THAT(text, HasSubstr("emitter.rings (type: flat): whole number, default 2, at least 1\n"));
  const auto read = ReadConfigText<Outer>("emitter: thesis", "x.yaml").emitter;
  EXPECT_EQ(std::get<Thesis>(read).decay, 9);
}

// Collects every path of a schema in the form of the reference.
void CollectPaths(const nlohmann::json& schema, const std::string& path,
                  std::set<std::string>& out) {
  const nlohmann::json properties = schema.value("properties", nlohmann::json::object());
  for (const auto& [key, inner] : properties.items()) {
    const std::string inner_path = path.empty() ? key : path + "." + key;
    out.insert(inner_path);
    CollectPaths(inner, inner_path, out);
  }
  const nlohmann::json any_of = schema.value("anyOf", nlohmann::json::array());
  for (const auto& inner : any_of) {
    CollectPaths(inner, path, out);
  }
  if (schema.contains("items")) {
    CollectPaths(schema["items"], path + "[]", out);
  }
}

TEST(OptionsSchema, IsJsonAndHasEveryPathOfTheReference) {
  const auto schema = nlohmann::json::parse(OptionsSchema<Options>());
  EXPECT_EQ(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
  std::set<std::string> paths;
  CollectPaths(schema, "", paths);
  std::istringstream reference(OptionsReference<Options>());
  int count = 0;
  for (std::string line; std::getline(reference, line);) {
    if (!line.starts_with(' ')) {
      ++count;
      EXPECT_TRUE(paths.contains(line.substr(0, line.find_first_of(" :")))) << line;
    }
  }
  EXPECT_EQ(count, 26);
  EXPECT_TRUE(paths.contains("base"));
  EXPECT_EQ(schema["properties"]["base"]["type"], nlohmann::json({"string", "array"}));
  const auto& radius = schema["properties"]["radius_mm"];
  EXPECT_EQ(radius["type"], "number");
  EXPECT_EQ(radius["minimum"], 0);
  EXPECT_EQ(radius["maximum"], 10);
  EXPECT_EQ(radius["default"], 2.5);
  EXPECT_EQ(schema["properties"]["schedule"]["minItems"], 1);
  EXPECT_EQ(schema["additionalProperties"], false);
}

}  // namespace
}  // namespace semblance::problems
