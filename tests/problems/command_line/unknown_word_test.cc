// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/command_line/unknown_word.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace semblance {
namespace {

CommandNode Option(const std::string& name) {
  return {.name = name, .purpose = {}, .options = {}, .commands = {}};
}

const CommandNode kProgram{
    .name = "semblance",
    .purpose = {},
    .options = {{.names = {"-h", "--help"}, .value = {}, .purpose = {}}},
    .commands = {{.name = "run",
                  .purpose = {},
                  .options = {{.names = {"CONFIG"}, .value = {}, .purpose = {}, .positional = true},
                              {.names = {"--set"}, .value = "TEXT", .purpose = {}},
                              {.names = {"--threads"}, .value = "INT", .purpose = {}}},
                  .commands = {}},
                 {.name = "feature",
                  .purpose = {},
                  .options = {},
                  .commands = {Option("extract"), Option("apply")}}}};

std::string Said(const std::vector<std::string>& words) { return UnknownWord(kProgram, words); }

TEST(UnknownWord, SuggestsTheNearestCommand) {
  EXPECT_EQ(Said({"rnu"}), "there is no command 'rnu'; did you mean 'run'?");
  EXPECT_EQ(Said({"feature", "aply", "x"}),
            "feature: there is no command 'aply'; did you mean 'apply'?");
  EXPECT_EQ(Said({"zzzzz"}), "there is no command 'zzzzz'; known are: run, feature");
}

TEST(UnknownWord, SuggestsTheNearestOptionOfTheCommandAlone) {
  EXPECT_EQ(Said({"run", "a.yaml", "--sett", "a=b"}),
            "run: there is no option '--sett'; did you mean '--set'?");
  EXPECT_EQ(Said({"run", "--thread=2"}),
            "run: there is no option '--thread'; did you mean '--threads'?");
  EXPECT_EQ(Said({"--hlep"}), "there is no option '--hlep'; did you mean '--help'?");
}

TEST(UnknownWord, IsSilentWhereAllAreKnown) {
  EXPECT_EQ(Said({}), "");
  EXPECT_EQ(Said({"run", "rnu", "--set", "x=1", "-5"}), "");
  EXPECT_EQ(Said({"run", "--", "--sett"}), "");
}

}  // namespace
}  // namespace semblance
