// SPDX-License-Identifier: GPL-3.0-or-later
// What shells and `man` are told is what the program declares, and a shell takes it.
#include "problems/command_line/shell_completion.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "problems/command_line/command_tree.h"
#include "problems/command_line/manual_page.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

CommandNode Sample() {
  const OptionText help{.names = {"-h", "--help"}, .value = {}, .purpose = "Print help"};
  const OptionText out{.names = {"--out"}, .value = "TEXT", .purpose = "it's the user's folder"};
  const OptionText again{.names = {"--again"},
                         .value = "TEXT",
                         .choices = {"failed", "all"},
                         .purpose = "what: failed or all"};
  const OptionText file{.names = {"FILE"}, .value = {}, .purpose = ".a file\\", .positional = true};
  return {
      .name = "tool",
      .purpose = "Does things.",
      .options = {help},
      .commands = {
          {.name = "run", .purpose = "run it", .options = {help, out, again, file}, .commands = {}},
          {.name = "marks",
           .purpose = "of a skull",
           .options = {help},
           .commands = {{.name = "convert",
                         .purpose = "from form to form",
                         .options = {help, out},
                         .commands = {}},
                        {.name = "propose",
                         .purpose = "where they may be",
                         .options = {help},
                         .commands = {}}}}}};
}

// What a shell command prints.
std::string Said(const std::string& command) {
  std::string said;
  std::array<char, 256> buffer;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  while (std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    said += buffer.data();
  }
  return said;
}

// What bash offers after these words, the last of them unfinished; files of an empty folder.
std::string Offered(const std::string& script, const std::string& words) {
  testing::ScratchFolder folder;
  std::ofstream(folder.Path() / "script") << script;
  return Said("cd '" + folder.Path().string() +
              "' && mkdir empty && cd empty && bash -c 'source ../script; COMP_WORDS=(" + words +
              "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _tool; echo \"${COMPREPLY[*]}\"'");
}

TEST(ShellCompletion, BashOffersWhatMayFollow) {
  const std::string script = BashCompletion(Sample());
  EXPECT_EQ(Offered(script, "tool \"\""), "run marks -h --help\n");
  EXPECT_EQ(Offered(script, "tool ma"), "marks\n");
  EXPECT_EQ(Offered(script, "tool marks pro"), "propose\n");
  EXPECT_EQ(Offered(script, "tool marks convert --"), "--help --out\n");
  EXPECT_EQ(Offered(script, "tool run file.yaml --o"), "--out\n");
  EXPECT_EQ(Offered(script, "tool propose --o"), "\n");  // no command of the program itself
  EXPECT_EQ(Offered(script, "tool run --again \"\""), "failed all\n");
  EXPECT_EQ(Offered(script, "tool run --out \"\""), "\n");  // files, and there are none
}

// As its own loader reads it, with what zsh gives to a completion in the place of what shows it.
std::string OfferedByZsh(const std::string& script, const std::string& words) {
  testing::ScratchFolder folder;
  std::ofstream(folder.Path() / "_tool") << script;
  return Said("cd '" + folder.Path().string() +
              "' && zsh -f -c 'fpath=($PWD $fpath); autoload -U _tool; words=(" + words +
              "); CURRENT=${#words}; PREFIX=${words[-1]};"
              "_describe() { print -r -- ${(P)2%%:*} }; _files() { print files };"
              "compadd() { print -r -- ${(P)2} }; _tool'");
}

TEST(ShellCompletion, ZshOffersWhatMayFollowAtTheFirstTime) {
  if (std::system("command -v zsh > /dev/null") != 0) {
    GTEST_SKIP() << "zsh is not installed";
  }
  const std::string script = ZshCompletion(Sample());
  EXPECT_EQ(OfferedByZsh(script, "tool \"\""), "run marks -h --help\n");
  EXPECT_EQ(OfferedByZsh(script, "tool marks convert --o"), "-h --help --out\n");
  EXPECT_EQ(OfferedByZsh(script, "tool run \"\""), "-h --help --out --again\nfiles\n");
  EXPECT_EQ(OfferedByZsh(script, "tool run --again \"\""), "failed all\n");
  EXPECT_EQ(OfferedByZsh(script, "tool run --out \"\""), "files\n");
}

std::string OfferedByFish(const std::string& script, const std::string& line) {
  testing::ScratchFolder folder;
  std::ofstream(folder.Path() / "script") << script;
  return Said("cd '" + folder.Path().string() + "' && mkdir empty && cd empty && HOME=" +
              folder.Path().string() + " fish -N -c 'source ../script; complete -C \"" + line +
              "\" | cut -f 1 | tr \"\\n\" \" \"'");
}

TEST(ShellCompletion, FishOffersWhatMayFollow) {
  if (std::system("command -v fish > /dev/null") != 0) {
    GTEST_SKIP() << "fish is not installed";
  }
  const std::string script = FishCompletion(Sample());
  EXPECT_EQ(OfferedByFish(script, "tool "), "marks run ");
  EXPECT_EQ(OfferedByFish(script, "tool marks "), "convert propose ");
  EXPECT_EQ(OfferedByFish(script, "tool marks convert --o"), "--out ");
  EXPECT_EQ(OfferedByFish(script, "tool run --again "), "all failed ");
  EXPECT_EQ(OfferedByFish(script, "tool run marks --o"), "--out ");  // a file called marks
  EXPECT_EQ(OfferedByFish(script, "tool propose --o"), "");
}

TEST(ShellCompletion, EveryShellKnowsEveryCommandAndOption) {
  const CommandNode program = Sample();
  for (const std::string& text :
       {BashCompletion(program), ZshCompletion(program), FishCompletion(program)}) {
    for (const char* word : {"run", "marks", "convert", "propose", "out", "help"}) {
      EXPECT_NE(text.find(word), std::string::npos) << word;
    }
    EXPECT_EQ(text.find("FILE"), std::string::npos);  // a positional is no word to type
  }
  EXPECT_NE(FishCompletion(program).find("-d 'it'\\''s the user'\\''s folder'"), std::string::npos);
}

TEST(CommandTree, TellsTheWordsThatAnOptionTakes) {
  enum class Side { kLeft, kRight };
  const std::map<std::string, Side> sides = {{"left", Side::kLeft}, {"right", Side::kRight}};
  CLI::App app("Does things.", "tool");
  std::string word, file;
  Side side = Side::kLeft;
  app.add_option("--word", word, "one of two")->check(CLI::IsMember({"a", "b c"}));
  app.add_option("--side", side, "of the head")->transform(CLI::CheckedTransformer(sides));
  app.add_option("--file", file, "any");
  const CommandNode tool = TreeOf(app);
  using Words = std::vector<std::string>;
  ASSERT_EQ(tool.options.size(), 4U);  // the first is --help
  EXPECT_EQ(tool.options[1].choices, (Words{"a", "b c"}));
  EXPECT_EQ(tool.options[2].choices, (Words{"left", "right"}));
  EXPECT_EQ(tool.options[3].choices, Words{});
}

TEST(ManualPage, HasEachCommandWithItsOptions) {
  const std::string page = ManualPage(Sample());
  for (const char* line :
       {".SS run FILE\n", ".SS marks\n", ".SS marks convert\n", ".SS marks propose\n",
        "\\fB\\-\\-out\\fR \\fITEXT\\fR\n", "\\&.a file\\e\n"}) {
    EXPECT_NE(page.find(line), std::string::npos) << line;
  }
  EXPECT_NE(page.find(".SH NAME\nsemblance \\- "), std::string::npos);  // what `apropos` reads
}

}  // namespace
}  // namespace semblance
