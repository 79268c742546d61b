// SPDX-License-Identifier: GPL-3.0-or-later
// The declared commands as data, for what is written of them.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace semblance {

struct OptionText {
  std::vector<std::string> names;         // with their dashes; of a positional its one name
  std::string value;                      // what it takes, e.g. TEXT; empty: a flag
  std::vector<std::string> choices = {};  // the words that it takes, where it takes no others
  std::string purpose;
  bool positional = false;
};

struct CommandNode {
  std::string name;
  std::string purpose;
  std::vector<OptionText> options;
  std::vector<CommandNode> commands;
};

// Of a command and all below it, in the order in which they were declared.
CommandNode TreeOf(const CLI::App& app);

// After a line was read: the first option that it gives an empty value, in a sentence; empty where
// there is none. A shell makes such a line of a variable that is not set.
std::string OptionWithoutValue(const CLI::App& app);

}  // namespace semblance
