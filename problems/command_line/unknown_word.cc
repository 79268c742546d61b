// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/command_line/unknown_word.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "problems/config/spelling_suggestion.h"

namespace semblance {
namespace {

bool IsLongOption(std::string_view word) { return word.size() > 2 && word.starts_with("--"); }

std::string UnknownCommand(const CommandNode& node, const std::string& called,
                           const std::string& word) {
  std::vector<std::string> known;
  for (const CommandNode& command : node.commands) {
    known.push_back(command.name);
  }
  return fmt::format("{}there is no command '{}'{}", called.empty() ? "" : called + ": ", word,
                     Suggestion(word, known));
}

std::string UnknownOption(const CommandNode& node, const std::string& called,
                          const std::string& word) {
  std::vector<std::string> known;
  for (const OptionText& option : node.options) {
    for (const std::string& name : option.names) {
      if (IsLongOption(name)) {
        known.push_back(name);
      }
    }
  }
  const bool is_known = std::ranges::find(known, word) != known.end();
  return is_known ? ""
                  : fmt::format("{}there is no option '{}'{}", called.empty() ? "" : called + ": ",
                                word, Suggestion(word, known));
}

}  // namespace

std::string UnknownWord(const CommandNode& program, std::span<const std::string> words) {
  const CommandNode* node = &program;
  std::string called;  // the commands so far
  for (const std::string& word : words) {
    if (word == "--") {
      break;
    }
    if (IsLongOption(word)) {
      const std::string complaint = UnknownOption(*node, called, word.substr(0, word.find('=')));
      if (!complaint.empty()) {
        return complaint;
      }
    } else if (!node->commands.empty() && !word.starts_with("-")) {
      const auto next = std::ranges::find(node->commands, word, &CommandNode::name);
      if (next == node->commands.end()) {
        return UnknownCommand(*node, called, word);
      }
      node = &*next;
      called += (called.empty() ? "" : " ") + word;
    }
  }
  return "";
}

}  // namespace semblance
