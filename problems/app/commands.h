// SPDX-License-Identifier: GPL-3.0-or-later
// The commands of the program as data: each file of commands has one table, and main.cc declares
// the commands of all tables. `semblance --help` lists them in this order.
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

namespace semblance::problems {

// The connection between a declared command and the rest of the program.
struct CommandLine {
  std::stop_token stop;         // set by Ctrl-C; a long command ends early then
  std::function<int()> chosen;  // set by the command on the line; returns the exit code
};

struct ProgramCommand {
  const char* name;
  const char* purpose;  // one line, for --help
  // Adds the options of the command. Parsing the command must then set `line.chosen`.
  void (*declare)(CLI::App& command, CommandLine& line);
};

// Validates a number: refuses nan and inf, which CLI::Range accepts.
inline CLI::Validator Finite() {
  return {[](std::string& text) -> std::string {
            double number = 0;
            return CLI::detail::lexical_cast(text, number) && !std::isfinite(number)
                       ? "'" + text + "' is not a finite number"
                       : "";
          },
          ""};
}

// Validates a whole number from 0 on. CLI11 alone would read -1 as the largest number and 010 as
// eight.
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

// Returns Arguments for the options of a command to write to. If the command is chosen, `run` gets
// them after the whole line is parsed.
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

}  // namespace semblance::problems
