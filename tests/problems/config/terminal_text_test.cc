// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/terminal_text.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace semblance::problems {
namespace {

TEST(TerminalText, KeepsLinesAndLettersAndReplacesControlCharacters) {
  EXPECT_EQ(ForTerminal("one\ntwo\n"), "one\ntwo\n");
  EXPECT_EQ(ForTerminal("a\x1b[2Jb\n\x07\r\t\x7f"), "a?[2Jb\n????");
  EXPECT_EQ(ForTerminal("\u009bm\u00a0\u00e4\u2028"), "?m\u00a0\u00e4\u2028");
  EXPECT_EQ(ForTerminal("\xc2"), "\xc2") << "cut short";
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
