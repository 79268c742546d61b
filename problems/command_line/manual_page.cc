// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/command_line/manual_page.h"

#include <fmt/format.h>

namespace semblance {
namespace {

// Troff takes a backslash and a dot or quote at the beginning of a line for its own; a bare dash is
// a hyphen to it, which cannot be copied to a shell.
std::string Plain(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    if (c == '\\') {
      plain += "\\e";
    } else if (c == '-') {
      plain += "\\-";
    } else if ((c == '.' || c == '\'') && (plain.empty() || plain.back() == '\n')) {
      plain += fmt::format("\\&{}", c);
    } else {
      plain += c;
    }
  }
  return plain;
}

std::string OptionEntry(const OptionText& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", Plain(name));
  }
  const std::string value = option.value.empty() ? "" : fmt::format(" \\fI{}\\fR", option.value);
  return fmt::format(".TP\n{}{}\n{}\n", names, value, Plain(option.purpose));
}

std::string CommandEntry(const CommandNode& command, const std::string& before) {
  const std::string name = before + command.name;
  std::string positionals;
  for (const OptionText& option : command.options) {
    positionals += option.positional ? " " + option.names.front() : "";
  }
  std::string text =
      fmt::format(".SS {}{}\n{}.\n", Plain(name), Plain(positionals), Plain(command.purpose));
  for (const OptionText& option : command.options) {
    text += OptionEntry(option);
  }
  for (const CommandNode& below : command.commands) {
    text += CommandEntry(below, name + " ");
  }
  return text;
}

}  // namespace

std::string ManualPage(const CommandNode& program) {
  std::string text = fmt::format(
      ".TH SEMBLANCE 1 \"\" \"semblance {}\" \"User Commands\"\n.SH NAME\nsemblance \\- face from "
      "skull, and a bench on which the ways of doing so are compared\n.SH SYNOPSIS\n.B "
      "semblance\n\\fICOMMAND\\fR [\\fIOPTION\\fR]...\n.SH DESCRIPTION\n{}\n.SH COMMANDS\n",
      SEMBLANCE_VERSION, Plain(program.purpose));
  for (const CommandNode& command : program.commands) {
    text += CommandEntry(command, "");
  }
  text +=
      ".SH EXIT STATUS\n.TP\n0\ndone\n.TP\n1\nran, but the result is not usable\n.TP\n2\nbad "
      "input\n.SH SEE ALSO\n\\fBsemblance options\\fR prints every option of a configuration.\n";
  return text;
}

}  // namespace semblance
