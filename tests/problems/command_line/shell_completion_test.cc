// SPDX-License-Identifier: GPL-3.0-or-later
// What shells and `man` are told is what the program declares, and a shell takes it.
#include "problems/command_line/shell_completion.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

#include "problems/command_line/manual_page.h"
#include "tests/testing/scratch_folder.h"

namespace semblance {
namespace {

CommandNode Sample() {
  const OptionText help{.names = {"-h", "--help"}, .value = {}, .purpose = "Print help"};
  const OptionText out{.names = {"--out"}, .value = "TEXT", .purpose = "it's the user's folder"};
  const OptionText file{.names = {"FILE"}, .value = {}, .purpose = ".a file\\", .positional = true};
  return {.name = "tool",
          .purpose = "Does things.",
          .options = {help},
          .commands = {
              {.name = "run", .purpose = "run it", .options = {help, out, file}, .commands = {}},
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
