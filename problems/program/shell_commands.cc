// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/shell_commands.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>

#include "problems/command_line/command_tree.h"
#include "problems/command_line/exit_code.h"
#include "problems/command_line/shell_completion.h"

namespace semblance {
namespace {

struct ShellArguments {
  const CLI::App* command = nullptr;
  std::string shell;
};

CommandNode Everything(const ShellArguments& a) { return TreeOf(*a.command->get_parent()); }

int Print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  return kDone;
}

int Completion(const ShellArguments& a) {
  const CommandNode program = Everything(a);
  return Print(a.shell == "bash"  ? BashCompletion(program)
               : a.shell == "zsh" ? ZshCompletion(program)
                                  : FishCompletion(program));
}

int Manual(const ShellArguments& a) { return Print(ManualPage(Everything(a))); }

void DeclareCompletion(CLI::App& completion, CommandLine& line) {
  ShellArguments& a = *Bind(completion, line, &Completion);
  a.command = &completion;
  completion.add_option("SHELL", a.shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
}

void DeclareManual(CLI::App& manual, CommandLine& line) {
  Bind(manual, line, &Manual)->command = &manual;
}

}  // namespace

std::span<const ProgramCommand> ShellCommands() {
  static constexpr std::array kCommands = {
      ProgramCommand{"completion", "print what makes a shell complete the commands and options",
                     &DeclareCompletion},
      ProgramCommand{"manual", "print the manual page, for man -l -", &DeclareManual},
  };
  return kCommands;
}

}  // namespace semblance
