// SPDX-License-Identifier: GPL-3.0-or-later
// Calls the program in a folder of the test. Needs the definition SEMBLANCE_PROGRAM.
#pragma once

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdlib>
#include <string>

#include "surfaces/base/atomic_file.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::testing {
using namespace problems;

struct Outcome {
  int code = -1;
  std::string out, err;
};

// before: shell commands to run first, e.g. "ulimit -v 500000;".
inline Outcome CallProgram(const ScratchFolder& folder, const std::string& arguments,
                           const std::string& before = "") {
  const std::string command =
      fmt::format("cd '{}' && {} '{}' {} > stdout.txt 2> stderr.txt", folder.Path().string(),
                  before, SEMBLANCE_PROGRAM, arguments);
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadFileBytes(folder / "stdout.txt"),
          ReadFileBytes(folder / "stderr.txt")};
}

}  // namespace semblance::testing
