// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/terminal_text.h"

#include <gtest/gtest.h>

namespace semblance {
namespace {

TEST(TerminalText, LinesAndLettersStayControlsDoNot) {
  EXPECT_EQ(ForTerminal("one\ntwo\n"), "one\ntwo\n");
  EXPECT_EQ(ForTerminal("a\x1b[2Jb\n\x07\r\t\x7f"), "a?[2Jb\n????");
  EXPECT_EQ(ForTerminal("\u009bm\u00a0\u00e4\u2028"), "?m\u00a0\u00e4\u2028");
  EXPECT_EQ(ForTerminal("\xc2"), "\xc2") << "cut short";
}

}  // namespace
}  // namespace semblance
