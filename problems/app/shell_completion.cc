// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/shell_completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <functional>

#include "problems/config/terminal_text.h"

namespace semblance::problems {
namespace {

// Calls `use` for each command, with the words that lead to it: "landmarks convert".
void ForEachCommand(const CommandNode& node, const std::string& path,
                    const std::function<void(const CommandNode&, const std::string&)>& use) {
  use(node, path);
  for (const CommandNode& below : node.commands) {
    ForEachCommand(below, path.empty() ? below.name : path + " " + below.name, use);
  }
}

// A word that may follow, and its meaning.
struct NextWord {
  std::string word;
  std::string purpose;
};

// Collects the words that may follow a command: commands, allowed words of a positional, options.
std::vector<NextWord> WordsAfter(const CommandNode& node) {
  std::vector<NextWord> words;
  for (const CommandNode& below : node.commands) {
    words.push_back({below.name, below.purpose});
  }
  for (const OptionText& option : node.options) {
    for (const std::string& name : option.positional ? option.choices : option.names) {
      words.push_back({name, option.purpose});
    }
  }
  return words;
}

std::string BashList(const std::vector<NextWord>& words) {
  std::string list;
  for (const NextWord& next : words) {
    list += (list.empty() ? "" : " ") + next.word;
  }
  return QuotedForShell(list);
}

// Writes a zsh array with entries `word:purpose`.
std::string ZshList(const std::vector<NextWord>& words) {
  std::string list = "(";
  for (const NextWord& next : words) {
    list += (list.size() == 1 ? "" : " ") + QuotedForShell(next.word + ":" + next.purpose);
  }
  return list + ")";
}

// Branches of the script's `case` statements.
struct Cases {
  std::string steps;   // from a command and the next word to the next command
  std::string words;   // from a command to the words that may follow
  std::string values;  // from an option to its allowed words, or to "files" if any text is allowed
};

void AddValues(const CommandNode& node, const std::string& path, std::string& values) {
  for (const OptionText& option : node.options) {
    for (std::size_t k = 0; !option.value.empty() && k < option.names.size(); ++k) {
      values +=
          fmt::format("    {}) value={} ;;\n", QuotedForShell(path + ":" + option.names[k]),
                      option.choices.empty()
                          ? std::string("files")
                          : QuotedForShell(fmt::format("{}", fmt::join(option.choices, " "))));
    }
  }
}

Cases MakeCases(const CommandNode& program,
                const std::function<std::string(const std::vector<NextWord>&)>& list) {
  Cases cases;
  ForEachCommand(program, "", [&](const CommandNode& node, const std::string& path) {
    cases.words +=
        fmt::format("    {}) next={} ;;\n", QuotedForShell(path), list(WordsAfter(node)));
    for (const CommandNode& below : node.commands) {
      cases.steps +=
          fmt::format("      {}) at={} ;;\n", QuotedForShell(path + ":" + below.name),
                      QuotedForShell(path.empty() ? below.name : path + " " + below.name));
    }
    AddValues(node, path, cases.values);
  });
  return cases;
}

// Describes an option for fish, with its allowed words, or with files if any text is allowed.
std::string FishOption(const OptionText& option) {
  std::string text;
  for (const std::string& name : option.names) {
    text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  }
  if (!option.choices.empty()) {
    return text + " -x -a " + QuotedForShell(fmt::format("{}", fmt::join(option.choices, " ")));
  }
  return text + (option.value.empty() ? "" : " -r");
}

// Escapes a text for troff: backslashes, dots and quotes at the start of a line, and dashes, which
// troff would print as hyphens that cannot be copied to a shell.
std::string EscapeTroff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\e";
    } else if (c == '-') {
      escaped += "\\-";
    } else if ((c == '.' || c == '\'') && (escaped.empty() || escaped.back() == '\n')) {
      escaped += fmt::format("\\&{}", c);
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string OptionEntry(const OptionText& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += fmt::format("{}\\fB{}\\fR", names.empty() ? "" : ", ", EscapeTroff(name));
  }
  const std::string value = option.value.empty() ? "" : fmt::format(" \\fI{}\\fR", option.value);
  return fmt::format(".TP\n{}{}\n{}\n", names, value, EscapeTroff(option.purpose));
}

std::string CommandEntry(const CommandNode& command, const std::string& before) {
  const std::string name = before + command.name;
  std::string positionals;
  for (const OptionText& option : command.options) {
    positionals += option.positional ? " " + option.names.front() : "";
  }
  std::string text = fmt::format(".SS {}{}\n{}.\n", EscapeTroff(name), EscapeTroff(positionals),
                                 EscapeTroff(command.purpose));
  for (const OptionText& option : command.options) {
    text += OptionEntry(option);
  }
  for (const CommandNode& below : command.commands) {
    text += CommandEntry(below, name + " ");
  }
  return text;
}

}  // namespace

std::string BashCompletion(const CommandNode& program) {
  const Cases cases = MakeCases(program, &BashList);
  return fmt::format(
      R"(# bash completion of {0}
_{0}() {{
  local current="${{COMP_WORDS[COMP_CWORD]}}" at='' next='' value='' word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$at:$word" in
{1}    esac
  done
  case "$at:${{COMP_WORDS[COMP_CWORD-1]}}" in
{3}  esac
  case "$at" in
{2}  esac
  if [[ -n $value && $value != files ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$value" -- "$current")
  elif [[ -n $value ]]; then
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -W "$next" -- "$current"
      [[ -z $at || $current == -* ]] || compgen -f -- "$current")
  fi
}}
complete -o filenames -F _{0} {0}
)",
      program.name, cases.steps, cases.words, cases.values);
}

std::string ZshCompletion(const CommandNode& program) {
  const Cases cases = MakeCases(program, &ZshList);
  return fmt::format(
      R"(#compdef {0}
_{0}() {{
  local at='' value='' word
  local -a next values
  for word in "${{(@)words[2,CURRENT-1]}}"; do
    case "$at:$word" in
{1}    esac
  done
  case "$at:${{words[CURRENT-1]}}" in
{3}  esac
  case "$at" in
{2}  esac
  if [[ $value == files ]]; then
    _files
  elif [[ -n $value ]]; then
    values=(${{=value}})
    compadd -a values
  else
    _describe '{0}' next
    [[ -z $at || $PREFIX == -* ]] || _files
  fi
}}
# zsh's own loader calls the function at once; a sourced file only registers it.
if [[ "${{funcstack[1]}}" == _{0} ]]; then
  _{0} "$@"
else
  compdef _{0} {0}
fi
)",
      program.name, cases.steps, cases.words, cases.values);
}

std::string FishCompletion(const CommandNode& program) {
  std::string steps, lines;
  ForEachCommand(program, "", [&](const CommandNode& node, const std::string& path) {
    const std::string add =
        fmt::format("complete -c {0} -n {1}", program.name,
                    QuotedForShell(fmt::format("__{}_at '{}'", program.name, path)));
    for (const CommandNode& below : node.commands) {
      const std::string next = path.empty() ? below.name : path + " " + below.name;
      steps += fmt::format("      case {}; set at {}\n", QuotedForShell(path + ":" + below.name),
                           QuotedForShell(next));
      lines += fmt::format("{} -f -a {} -d {}\n", add, below.name, QuotedForShell(below.purpose));
    }
    for (const OptionText& option : node.options) {
      if (!option.positional) {
        lines +=
            fmt::format("{}{} -d {}\n", add, FishOption(option), QuotedForShell(option.purpose));
      } else if (!option.choices.empty()) {
        lines += fmt::format("{} -f -a {}\n", add,
                             QuotedForShell(fmt::format("{}", fmt::join(option.choices, " "))));
      }
    }
  });
  return fmt::format(
      R"(# fish completion of {0}
function __{0}_at
  set -l at ''
  for word in (commandline -opc)[2..-1]
    switch "$at:$word"
{1}    end
  end
  test "$at" = "$argv[1]"
end
complete -c {0} -n '__{0}_at ""' -f
{2})",
      program.name, steps, lines);
}

std::string ManualPage(const CommandNode& program) {
  std::string text = fmt::format(
      ".TH SEMBLANCE 1 \"\" \"semblance {}\" \"User Commands\"\n.SH NAME\nsemblance \\- face from "
      "skull, and a bench on which the ways of doing so are compared\n.SH SYNOPSIS\n.B "
      "semblance\n\\fICOMMAND\\fR [\\fIOPTION\\fR]...\n.SH DESCRIPTION\n{}\n.SH COMMANDS\n",
      SEMBLANCE_VERSION, EscapeTroff(program.purpose));
  for (const CommandNode& command : program.commands) {
    text += CommandEntry(command, "");
  }
  text +=
      ".SH EXIT STATUS\n.TP\n0\ndone\n.TP\n1\nran, but the result is not usable\n.TP\n2\nbad "
      "input\n.SH SEE ALSO\n\\fBsemblance options\\fR prints every option of a configuration.\n";
  return text;
}

}  // namespace semblance::problems
