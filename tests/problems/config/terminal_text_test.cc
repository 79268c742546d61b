// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/terminal_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "problems/config/utf8_check.h"

namespace semblance::problems {
namespace {

TEST(TerminalText, KeepsLinesAndLettersAndReplacesControlCharacters) {
  EXPECT_EQ(ForTerminal("one\ntwo\n"), "one\ntwo\n");
  EXPECT_EQ(ForTerminal("a\x1b[2Jb\n\x07\r\t\x7f"), "a?[2Jb\n????");
  EXPECT_EQ(ForTerminal("\u009bm\u00a0\u00e4\u2028"), "?m\u00a0\u00e4?");
  EXPECT_EQ(ForTerminal("\xc2"), "?") << "cut short";
  EXPECT_EQ(ForTerminal("caf\xe9 \x9b 31m"), "caf? ? 31m") << "Latin-1";
}

// Marks that turn the direction of writing show another name than the one that is compared.
TEST(TerminalText, ReplacesMarksOfDirection) {
  for (const char* mark : {"\u061c", "\u200e", "\u200f", "\u202a", "\u202e", "\u2066", "\u2069"}) {
    EXPECT_EQ(ForTerminal(std::string("a") + mark + "b"), "a?b");
    EXPECT_EQ(PlainText(std::string("a") + mark + "b"), "a?b");
  }
  EXPECT_EQ(ForTerminal("\u05d0\u0627\u4e2d\U0001F600"), "\u05d0\u0627\u4e2d\U0001F600");
  EXPECT_EQ(PlainText("a\n\tb\r"), "a\n\tb?");
}

TEST(TerminalText, JsonHasPlainTextsAndKeys) {
  const nlohmann::ordered_json json = {{"k\x1b", {"a\u202e", 1.5, nullptr, {{"n", "\xff"}}}},
                                       {"empty", nlohmann::json::object()}};
  EXPECT_EQ(WithPlainTexts(json).dump(), R"({"k?":["a?",1.5,null,{"n":"?"}],"empty":{}})");
}

TEST(Utf8, CharactersAreThoseOfTheText) {
  const std::string text = "a\u00e9\u20ac\U0001F600\xff";
  std::vector<char32_t> codes;
  std::string joined;
  for (const Character& c : SplitCharacters(text)) {
    codes.push_back(c.code);
    joined += c.bytes;
  }
  EXPECT_EQ(codes, (std::vector<char32_t>{'a', 0xE9, 0x20AC, 0x1F600, Character::kNotUtf8}));
  EXPECT_EQ(joined, text);
}

TEST(Utf8, NormalFormsAreThoseOfUnicode) {
  EXPECT_EQ(Normalized("e\u0301"), "\u00e9");
  EXPECT_EQ(Normalized("\u00e9", NormalForm::kDecomposed), "e\u0301");
  EXPECT_EQ(Normalized("\u1100\u1161"), "\uac00") << "Hangul";
  EXPECT_EQ(Normalized("\u212b"), "\u00c5") << "the sign of Angstrom";
  EXPECT_EQ(Normalized("e\u0301\xff"), "e\u0301\xff") << "not UTF-8";
  EXPECT_EQ(Normalized(""), "");
}

// Returns a word as a shell reads it.
std::string Echoed(const std::string& word) {
  std::FILE* const shell = popen(fmt::format("printf %s {}", word).c_str(), "r");
  std::string said;
  for (int c = std::fgetc(shell); c != EOF; c = std::fgetc(shell)) {
    said.push_back(static_cast<char>(c));
  }
  return pclose(shell) == 0 ? said : "the shell failed";
}

TEST(TerminalText, QuotedTextComesBackFromAShell) {
  for (const std::string text : {"a b", "it's", "''", "$HOME `id` \\ \"x\" * ; & |\n#", "-n", ""}) {
    EXPECT_EQ(Echoed(QuotedForShell(text)), text);
  }
}

}  // namespace
}  // namespace semblance::problems
