// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/program_call.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace semblance::bench {
namespace {

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

[[noreturn]] void BecomeProgram(std::vector<std::string> arguments) {
  std::vector<char*> words;
  arguments.insert(arguments.begin(), "semblance");
  for (std::string& argument : arguments) {
    words.push_back(argument.data());
  }
  words.push_back(nullptr);
  dup2(STDERR_FILENO, STDOUT_FILENO);  // standard output is for entries
  execv(SEMBLANCE_PROGRAM, words.data());
  _exit(127);
}

}  // namespace

CallCost CallProgram(const std::vector<std::string>& arguments) {
  const pid_t child = fork();
  if (child == 0) {
    BecomeProgram(arguments);
  }
  int status = -1;
  rusage usage{};
  wait4(child, &status, 0, &usage);
  // A face that is not usable (code 1) was computed all the same.
  if (!WIFEXITED(status) || WEXITSTATUS(status) > 1) {
    return {};
  }
  return {.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime),
          .peak_mb = 1024e-6 * static_cast<double>(usage.ru_maxrss)};
}

CallCost MedianCall(const std::vector<std::string>& arguments) {
  std::array<CallCost, 3> calls;
  std::ranges::generate(calls, [&] { return CallProgram(arguments); });
  std::ranges::sort(calls, {}, &CallCost::cpu_s);
  return calls[1];
}

}  // namespace semblance::bench
