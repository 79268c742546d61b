// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/command_line/shell_completion.h"

#include <fmt/format.h>

#include <functional>

namespace semblance {
namespace {

// Each command, with the words that lead to it: "landmarks convert".
void ForEachCommand(const CommandNode& node, const std::string& path,
                    const std::function<void(const CommandNode&, const std::string&)>& use) {
  use(node, path);
  for (const CommandNode& below : node.commands) {
    ForEachCommand(below, path.empty() ? below.name : path + " " + below.name, use);
  }
}

// In single quotes.
std::string Quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + "'";
}

std::string WordsAfter(const CommandNode& node) {
  std::string words;
  for (const CommandNode& below : node.commands) {
    words += below.name + " ";
  }
  for (const OptionText& option : node.options) {
    for (std::size_t k = 0; !option.positional && k < option.names.size(); ++k) {
      words += option.names[k] + " ";
    }
  }
  return words.substr(0, words.size() - (words.empty() ? 0 : 1));
}

// The shell's `case` of how words lead from one command to the next, and that of what may follow.
struct Cases {
  std::string steps;
  std::string words;
};

Cases CasesOf(const CommandNode& program) {
  Cases cases;
  ForEachCommand(program, "", [&](const CommandNode& node, const std::string& path) {
    cases.words += fmt::format("    {}) next={} ;;\n", Quoted(path), Quoted(WordsAfter(node)));
    for (const CommandNode& below : node.commands) {
      cases.steps += fmt::format("      {}) at={} ;;\n", Quoted(path + ":" + below.name),
                                 Quoted(path.empty() ? below.name : path + " " + below.name));
    }
  });
  return cases;
}

}  // namespace

std::string BashCompletion(const CommandNode& program) {
  const Cases cases = CasesOf(program);
  return fmt::format(
      "# bash completion of {0}\n_{0}() {{\n  local current=\"${{COMP_WORDS[COMP_CWORD]}}\" at='' "
      "next='' word\n  for word in \"${{COMP_WORDS[@]:1:COMP_CWORD-1}}\"; do\n    case "
      "\"$at:$word\" in\n{1}    esac\n  done\n  case \"$at\" in\n{2}  esac\n"
      "  mapfile -t COMPREPLY < <(compgen -W \"$next\" -- \"$current\"; "
      "[[ -z $at || $current == -* ]] || compgen -f -- \"$current\")\n}}\n"
      "complete -o filenames -F _{0} {0}\n",
      program.name, cases.steps, cases.words);
}

std::string ZshCompletion(const CommandNode& program) {
  const Cases cases = CasesOf(program);
  return fmt::format(
      "#compdef {0}\n_{0}() {{\n  local at='' next='' word\n  for word in "
      "\"${{(@)words[2,CURRENT-1]}}\"; do\n    case \"$at:$word\" in\n{1}    esac\n  done\n  case "
      "\"$at\" in\n{2}  esac\n  compadd -- ${{=next}}\n  [[ -z $at ]] || _files\n}}\n"
      "compdef _{0} {0}\n",
      program.name, cases.steps, cases.words);
}

std::string FishCompletion(const CommandNode& program) {
  std::string text = fmt::format("# fish completion of {}\n", program.name);
  ForEachCommand(program, "", [&](const CommandNode& node, const std::string& path) {
    const std::string last = path.substr(path.rfind(' ') + 1);
    const std::string when = path.empty() ? "__fish_use_subcommand"
                                          : fmt::format("__fish_seen_subcommand_from {}", last);
    for (const CommandNode& below : node.commands) {
      text += fmt::format("complete -c {} -n {} -a {} -d {}\n", program.name, Quoted(when),
                          below.name, Quoted(below.purpose));
    }
    for (const OptionText& option : node.options) {
      if (option.positional) {
        continue;
      }
      std::string names;
      for (const std::string& name : option.names) {
        names += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      text += fmt::format("complete -c {} -n {}{}{} -d {}\n", program.name, Quoted(when), names,
                          option.value.empty() ? "" : " -r", Quoted(option.purpose));
    }
  });
  return text;
}

}  // namespace semblance
