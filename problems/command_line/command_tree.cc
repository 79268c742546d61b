// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/command_line/command_tree.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <sstream>

namespace semblance {
namespace {

// CLI11 tells a choice in the name of its type: "TEXT:{failed,unusable,all}", and of words that
// become values "ENUM:value in {LPS->0,RAS->1} OR {0,1}".
std::vector<std::string> ChoicesOf(const std::string& type) {
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

OptionText TextOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  OptionText text{
      .names = {}, .value = {}, .choices = ChoicesOf(type), .purpose = option.get_description()};
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

}  // namespace

CommandNode TreeOf(const CLI::App& app) {
  CommandNode node{
      .name = app.get_name(), .purpose = app.get_description(), .options = {}, .commands = {}};
  for (const CLI::Option* option : app.get_options()) {
    node.options.push_back(TextOf(*option));
  }
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    node.commands.push_back(TreeOf(*command));
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

}  // namespace semblance
