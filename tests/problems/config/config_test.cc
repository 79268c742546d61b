// SPDX-License-Identifier: GPL-3.0-or-later
// Reading strictly: what is accepted, and the exact words for all that is not.
#include "problems/config/config.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "problems/config/spelling_suggestion.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/config_samples.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using testing::Flat;
using testing::Mixed;
using testing::Options;
using testing::Thesis;

Options Read(const std::string& text) { return ReadConfigText<Options>(text, "/cfg/x.yaml"); }

// The errors of a text, without the name of the file before each.
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

TEST(Config, SaysExactlyWhatIsWrong) {
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
       "x.yaml:1:12: radius_mm: '010.5' is not plainly decimal; write a number without a leading "
       "0"},
      {"count: 010",
       "x.yaml:1:8: count: '010' is not plainly decimal; write a whole number without a leading 0"},
      {"count: 0o17",
       "x.yaml:1:8: count: '0o17' is not plainly decimal; write a whole number without a leading "
       "0"},
      {"count: 0x1F",
       "x.yaml:1:8: count: '0x1F' is not plainly decimal; write a whole number without a leading "
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
      {"count: 1.5",
       "x.yaml:1:8: count: expected a whole number, found 1.5; write it in digits alone"},
      {"count: 1e1",
       "x.yaml:1:8: count: expected a whole number, found 1e1; write it in digits alone"},
      {"count: three", "x.yaml:1:8: count: expected a whole number, found 'three'"},
      {"count: +-3", "x.yaml:1:8: count: expected a whole number, found '+-3'"},
      {"count: 2147483648",
       "x.yaml:1:8: count: 2147483648 does not fit; allowed is -2147483648 to 2147483647"},
      {"random_seed: 18446744073709551616",
       "x.yaml:1:14: random_seed: 18446744073709551616 does not fit; allowed is 0 to "
       "18446744073709551615"},
      {"random_seed: -1",
       "x.yaml:1:14: random_seed: -1 does not fit; allowed is 0 to 18446744073709551615"},
      // Texts that swallow what follows.
      {"label: \"a\ncount: 3\"",
       "x.yaml:1:8: label: the quote that begins here is not closed in its line; close it (a text "
       "of several lines is written as a block, after |)"},
      {"label: 'it''s\ncount: 3'",
       "x.yaml:1:8: label: the quote that begins here is not closed in its line; close it (a text "
       "of several lines is written as a block, after |)"},
      {"{label: a\n  b}",
       "x.yaml:1:9: label: a text within brackets goes on in the next line; is a comma or a "
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
      {"- 1\n- 2", "x.yaml:1:1: expected a map of options at the top, found a list"},
      {"hello", "x.yaml:1:1: expected a map of options at the top, found a scalar"},
      // true and false.
      {"verbose: yes", "x.yaml:1:10: verbose: expected true or false, found 'yes'"},
      {"verbose: off", "x.yaml:1:10: verbose: expected true or false, found 'off'"},
      {"verbose: True", "x.yaml:1:10: verbose: expected true or false, found 'True'"},
      {"verbose: \"true\"",
       "x.yaml:1:10: verbose: expected true or false, found the text \"true\""},
      {"verbose: 1", "x.yaml:1:10: verbose: expected true or false, found '1'"},
      // Null; the place is that of the key.
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
      {"label: \xe0\x80\x80",  // longer than it need be
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
                HasSubstr("more than 64 levels of maps and lists within each other"));
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

// Distances by hand.
TEST(NearestWord, CountsEditsAndSwaps) {
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
  EXPECT_EQ(EditDistance("fiel", "file"), 1);
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("Decay", "decay"), 0);
  const std::vector<std::string> known = {"thesis", "split", "flat"};
  EXPECT_EQ(NearestWord("splt", known), "split");
  EXPECT_EQ(NearestWord("voronoi", known), "");
  EXPECT_EQ(NearestWord(std::string(100'000'000, 's'), known), "");  // in no memory to speak of
}

// A run's folder that was sent to somebody: what went in lies beside resolved.yaml.
TEST(Config, AWholePathThatLeadsNowhereIsAFileBesideThisOne) {
  const testing::ScratchFolder folder;
  const std::filesystem::path file = folder / "resolved.yaml";
  const auto skull = [&](const std::filesystem::path& named) {
    WriteFileAtomically(file, fmt::format("skull: {}\n", named.string()));
    return ReadConfig<Options>(file).skull;
  };
  EXPECT_EQ(skull("/elsewhere/heads/skull.ply"), "/elsewhere/heads/skull.ply");
  WriteFileAtomically(folder / "skull.ply", "ply");
  EXPECT_EQ(skull("/elsewhere/heads/skull.ply"), folder / "skull.ply");
  // A file that is there is taken as it is named, and so is a path that is not whole.
  std::filesystem::create_directories(folder / "heads");
  EXPECT_EQ(skull("heads/skull.ply"), folder / "heads/skull.ply");
  WriteFileAtomically(folder / "heads/skull.ply", "ply");
  EXPECT_EQ(skull(folder / "heads/skull.ply"), folder / "heads/skull.ply");
}

}  // namespace
}  // namespace semblance
