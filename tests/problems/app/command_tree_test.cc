// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/command_tree.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace semblance::problems {
namespace {

CommandNode NamedCommand(const std::string& name) {
  return {.name = name, .purpose = {}, .options = {}, .commands = {}};
}

const CommandNode kTree{
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
                  .commands = {NamedCommand("extract"), NamedCommand("apply")}}}};

std::string Message(const std::vector<std::string>& words) { return UnknownWord(kTree, words); }

TEST(UnknownWord, SuggestsTheNearestCommand) {
  EXPECT_EQ(Message({"rnu"}), "there is no command 'rnu'; did you mean 'run'?");
  EXPECT_EQ(Message({"feature", "aply", "x"}),
            "feature: there is no command 'aply'; did you mean 'apply'?");
  EXPECT_EQ(Message({"zzzzz"}), "there is no command 'zzzzz'; known are: run, feature");
}

TEST(UnknownWord, SuggestsTheNearestOptionOfTheSameCommand) {
  EXPECT_EQ(Message({"run", "a.yaml", "--sett", "a=b"}),
            "run: there is no option '--sett'; did you mean '--set'?");
  EXPECT_EQ(Message({"run", "--thread=2"}),
            "run: there is no option '--thread'; did you mean '--threads'?");
  EXPECT_EQ(Message({"--hlep"}), "there is no option '--hlep'; did you mean '--help'?");
}

TEST(UnknownWord, IsEmptyIfAllWordsAreKnown) {
  EXPECT_EQ(Message({}), "");
  EXPECT_EQ(Message({"run", "rnu", "--set", "x=1", "-5"}), "");
  EXPECT_EQ(Message({"run", "--", "--sett"}), "");
}

TEST(CommandTree, HasTheAllowedWordsOfAnOption) {
  enum class Side { kLeft, kRight };
  const std::map<std::string, Side> sides = {{"left", Side::kLeft}, {"right", Side::kRight}};
  CLI::App app("Does things.", "tool");
  std::string word, file;
  Side side = Side::kLeft;
  app.add_option("--word", word, "one of two")->check(CLI::IsMember({"a", "b c"}));
  app.add_option("--side", side, "of the head")->transform(CLI::CheckedTransformer(sides));
  app.add_option("--file", file, "any");
  const CommandNode tool = MakeCommandTree(app);
  using Words = std::vector<std::string>;
  ASSERT_EQ(tool.options.size(), 4U);  // the first is --help
  EXPECT_EQ(tool.options[1].choices, (Words{"a", "b c"}));
  EXPECT_EQ(tool.options[2].choices, (Words{"left", "right"}));
  EXPECT_EQ(tool.options[3].choices, Words{});
}

}  // namespace
}  // namespace semblance::problems
