// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/command_line/command_tree.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

namespace semblance {
namespace {

OptionText TextOf(const CLI::Option& option) {
  OptionText text{.names = {}, .value = {}, .purpose = option.get_description()};
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
    text.value = option.get_type_name().substr(0, option.get_type_name().find(':'));
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
