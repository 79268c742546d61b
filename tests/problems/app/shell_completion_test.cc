// SPDX-License-Identifier: GPL-3.0-or-later
// Completions and the manual page have what the program declares, and real shells accept them.
#include "problems/app/shell_completion.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
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

// Runs a shell command and returns its output.
std::string Output(const std::string& command) {
  std::string output;
  std::array<char, 256> buffer;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  while (std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    output += buffer.data();
  }
  return output;
}

// Returns what bash offers after `words`, the last of which is unfinished, in an empty folder.
std::string OfferedByBash(const std::string& script, const std::string& words) {
  testing::ScratchFolder folder;
  std::ofstream(folder.Path() / "script") << script;
  return Output("cd '" + folder.Path().string() +
                "' && mkdir empty && cd empty && bash -c 'source ../script; COMP_WORDS=(" + words +
                "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _tool; echo \"${COMPREPLY[*]}\"'");
}

TEST(ShellCompletion, BashOffersTheNextWords) {
  const std::string script = BashCompletion(Sample());
  EXPECT_EQ(OfferedByBash(script, "tool \"\""), "run marks -h --help\n");
  EXPECT_EQ(OfferedByBash(script, "tool ma"), "marks\n");
  EXPECT_EQ(OfferedByBash(script, "tool marks pro"), "propose\n");
  EXPECT_EQ(OfferedByBash(script, "tool marks convert --"), "--help --out\n");
  EXPECT_EQ(OfferedByBash(script, "tool run file.yaml --o"), "--out\n");
  EXPECT_EQ(OfferedByBash(script, "tool propose --o"), "\n");  // `propose` is not a top command
  EXPECT_EQ(OfferedByBash(script, "tool run --again \"\""), "failed all\n");
  EXPECT_EQ(OfferedByBash(script, "tool run --out \"\""), "\n");  // files: the folder is empty
}

// Loads the script with zsh's own loader, with stand-ins that print the completions.
std::string OfferedByZsh(const std::string& script, const std::string& words) {
  testing::ScratchFolder folder;
  std::ofstream(folder.Path() / "_tool") << script;
  return Output("cd '" + folder.Path().string() +
                "' && zsh -f -c 'fpath=($PWD $fpath); autoload -U _tool; words=(" + words +
                "); CURRENT=${#words}; PREFIX=${words[-1]};"
                "_describe() { print -r -- ${(P)2%%:*} }; _files() { print files };"
                "compadd() { print -r -- ${(P)2} }; _tool'");
}

TEST(ShellCompletion, ZshOffersTheNextWordsAtTheFirstCall) {
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
  return Output("cd '" + folder.Path().string() + "' && mkdir empty && cd empty && HOME=" +
                folder.Path().string() + " fish -N -c 'source ../script; complete -C \"" + line +
                "\" | cut -f 1 | tr \"\\n\" \" \"'");
}

TEST(ShellCompletion, FishOffersTheNextWords) {
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

TEST(ShellCompletion, EveryScriptHasEveryCommandAndOption) {
  const CommandNode program = Sample();
  for (const std::string& text :
       {BashCompletion(program), ZshCompletion(program), FishCompletion(program)}) {
    for (const char* word : {"run", "marks", "convert", "propose", "out", "help"}) {
      EXPECT_NE(text.find(word), std::string::npos) << word;
    }
    EXPECT_EQ(text.find("FILE"), std::string::npos);  // a positional is not a word to type
  }
  EXPECT_NE(FishCompletion(program).find("-d 'it'\\''s the user'\\''s folder'"), std::string::npos);
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
}  // namespace semblance::problems
