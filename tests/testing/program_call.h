// SPDX-License-Identifier: GPL-3.0-or-later
// Calls the program in a folder of the test. Needs the definition SEMBLANCE_PROGRAM.
#pragma once

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>
#include <wordexp.h>

#include <cstdio>
#include <cstdlib>
#include <string>

#include "problems/app/program.h"
#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::testing {
using namespace problems;

struct Outcome {
  int code = -1;
  std::string out, err;
};

inline int ExitCodeOf(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : -1; }

// Calls the program's function in a copy of this process, which has loaded the shared libraries
// already: a new process takes 0.2 s of processor time for that. The first word is left free for
// the program's name.
inline int CallInCopy(const std::filesystem::path& folder, wordexp_t& words) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    char name[] = "semblance";
    words.we_wordv[0] = name;
    const bool ready = ::chdir(folder.c_str()) == 0 &&
                       std::freopen("stdout.txt", "w", stdout) != nullptr &&
                       std::freopen("stderr.txt", "w", stderr) != nullptr;
    const int code =
        ready ? RunProgram(static_cast<int>(words.we_wordc) + 1, words.we_wordv) : EXIT_FAILURE;
    std::fflush(nullptr);
    ::_exit(code);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return ExitCodeOf(status);
}

// The program as a new process of a shell, after other commands.
inline int CallInShell(const std::filesystem::path& folder, const std::string& arguments,
                       const std::string& before) {
  const std::string command = fmt::format("cd '{}' && {} '{}' {} > stdout.txt 2> stderr.txt",
                                          folder.string(), before, SEMBLANCE_PROGRAM, arguments);
  return ExitCodeOf(std::system(command.c_str()));
}

// before: shell commands to run first, e.g. "ulimit -v 500000;". Arguments that only a shell
// understands, such as "< file", go to a shell too, and in builds that observe whole processes
// (sanitizers and coverage) all do.
inline Outcome CallProgram(const ScratchFolder& folder, const std::string& arguments,
                           const std::string& before = "") {
#ifdef SEMBLANCE_OBSERVED
  constexpr bool kCopies = false;
#else
  constexpr bool kCopies = true;
#endif
  wordexp_t words{};
  words.we_offs = 1;
  const bool plain =
      kCopies && before.empty() &&
      ::wordexp(arguments.c_str(), &words, WRDE_DOOFFS | WRDE_NOCMD | WRDE_UNDEF) == 0;
  const int code =
      plain ? CallInCopy(folder.Path(), words) : CallInShell(folder.Path(), arguments, before);
  if (plain) {
    ::wordfree(&words);
  }
  return {code, ReadFileBytes(folder / "stdout.txt"), ReadFileBytes(folder / "stderr.txt")};
}

}  // namespace semblance::testing
