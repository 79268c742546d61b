// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/command_tree.h"
#include "problems/config/spelling_suggestion.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>
#include <string_view>
#include <vector>

namespace semblance::problems {
namespace {

// Reads the allowed words from the type name that CLI11 gives an option:
// "TEXT:{failed,unusable,all}", or "ENUM:value in {LPS->0,RAS->1} OR {0,1}" for words with values.
std::vector<std::string> ParseChoices(const std::string& type) {
  const std::size_t begin = type.find('{'), end = type.find('}');
  std::vector<std::string> choices;
  if (begin == std::string::npos || end == std::string::npos || end < begin) {
    return choices;
  }
  std::istringstream list(type.substr(begin + 1, end - begin - 1));
  for (std::string word; std::getline(list, word, ',');) {
    choices.push_back(word.substr(0, word.find("->")));
  }
  return choices;
}

OptionText DescribeOption(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  OptionText text{
      .names = {}, .value = {}, .choices = ParseChoices(type), .purpose = option.get_description()};
  for (const std::string& name : option.get_snames()) {
    text.names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    text.names.push_back("--" + name);
  }
  if (text.names.empty()) {
    text.positional = true;
    text.names.push_back(option.get_name());
  } else if (option.get_items_expected_max() > 0) {
    text.value = type.substr(0, type.find(':'));
  }
  return text;
}

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

CommandNode MakeCommandTree(const CLI::App& app) {
  CommandNode node{
      .name = app.get_name(), .purpose = app.get_description(), .options = {}, .commands = {}};
  for (const CLI::Option* option : app.get_options()) {
    node.options.push_back(DescribeOption(*option));
  }
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    node.commands.push_back(MakeCommandTree(*command));
  }
  return node;
}

std::string OptionWithoutValue(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional() && std::ranges::count(option->results(), std::string()) > 0) {
      return fmt::format("{}: {} is given an empty value; name one, or leave the option out",
                         app.get_name(), option->get_name());
    }
  }
  for (const CLI::App* command : app.get_subcommands()) {
    if (std::string words = OptionWithoutValue(*command); !words.empty()) {
      return words;
    }
  }
  return "";
}

std::string UnknownWord(const CommandNode& program, std::span<const std::string> words) {
  const CommandNode* node = &program;
  std::string called;  // the commands read so far
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

}  // namespace semblance::problems
