// SPDX-License-Identifier: GPL-3.0-or-later
// The declared commands as data: for completions and the manual page (shell_completion.h), and to
// name the word of a command line that is wrong.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace semblance::problems {

struct OptionText {
  std::vector<std::string> names;         // with dashes; a positional argument has one name
  std::string value;                      // kind of its value, e.g. TEXT; empty for a flag
  std::vector<std::string> choices = {};  // the allowed words; empty if any text is allowed
  std::string purpose;
  bool positional = false;
};

struct CommandNode {
  std::string name;
  std::string purpose;
  std::vector<OptionText> options;
  std::vector<CommandNode> commands;
};

// Describes a command and all commands below it, in the order of their declaration.
CommandNode MakeCommandTree(const CLI::App& app);

// Returns a sentence about the first option that has an empty value after parsing, or "" if there
// is none. A shell produces such a command line from an unset variable.
std::string OptionWithoutValue(const CLI::App& app);

// Returns a sentence about the first unknown command or option of a refused command line, with the
// nearest known word, or "" if all words are known. `words` excludes the program's name.
std::string UnknownWord(const CommandNode& program, std::span<const std::string> words);

}  // namespace semblance::problems
