// SPDX-License-Identifier: GPL-3.0-or-later
// The commands of the program as data: each room of commands has one table, and main.cc declares
// what the tables say. `semblance --help` lists them in this order.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <system_error>
#include <utility>

namespace semblance {

// What a declared command has to do with the rest of the program.
struct CommandLine {
  std::stop_token stop;         // set by Ctrl-C; a long command ends early then
  std::function<int()> chosen;  // set by the command that stands on the line; returns the exit code
};

struct ProgramCommand {
  const char* name;
  const char* purpose;  // one line, for --help
  // Adds the options, and sees to it that `line.chosen` is set.
  void (*declare)(CLI::App& command, CommandLine& line);
};

// For options that take a number: not nan, not inf, which ranges let pass.
inline CLI::Validator Finite() {
  return {[](std::string& text) -> std::string {
            double number = 0;
            return CLI::detail::lexical_cast(text, number) && !std::isfinite(number)
                       ? "'" + text + "' is not a finite number"
                       : "";
          },
          ""};
}

// For options that take a whole number from 0 on: CLI11 would read -1 as the largest one, and 010
// as eight.
inline CLI::Validator WholeNumber() {
  return {[](std::string& text) -> std::string {
            std::uint64_t number = 0;
            const auto [end, error] =
                std::from_chars(text.data(), text.data() + text.size(), number);
            const bool whole = error == std::errc() && end == text.data() + text.size() &&
                               (number == 0 || text[0] != '0');
            return whole ? "" : "'" + text + "' is not a whole number from 0 to 2^64 - 1";
          },
          ""};
}

// What the user types goes into the Arguments returned; `run` gets them once all are parsed.
template <class Arguments>
std::shared_ptr<Arguments> Bind(CLI::App& command, CommandLine& line,
                                int (*run)(const Arguments&)) {
  auto arguments = std::make_shared<Arguments>();
  command.callback(
      [&line, arguments, run] { line.chosen = [arguments, run] { return run(*arguments); }; });
  return arguments;
}

inline void Declare(std::span<const ProgramCommand> commands, CLI::App& app, CommandLine& line) {
  for (const ProgramCommand& command : commands) {
    command.declare(*app.add_subcommand(command.name, command.purpose), line);
  }
}

}  // namespace semblance
