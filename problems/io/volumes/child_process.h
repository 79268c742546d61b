// SPDX-License-Identifier: GPL-3.0-or-later
// Runs work in a child process. Some libraries end the whole program when a file is damaged; in a
// child process they end only the child.
#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

namespace semblance::problems {

// The work calls this with the name of each file before it reads the file.
using ReportFile = std::function<void(const std::string& file)>;

struct ChildRights {
  double memory_bytes = 0;                           // in addition to what this process uses now
  std::vector<std::filesystem::path> readable = {};  // files, or folders with all that is in them
};

// Returns what `work` returns. A forked copy of this process does the work; its terminal and all
// open files are closed, it can read nothing but `readable` and write nothing but its result
// (confinement.h), and nothing else that it does is visible here. For each reported file it may use
// 1 s of processor time, and 1 s more for each 100 MB of `memory_bytes`. Rethrows an InputError or
// IoError of the work. Throws IoError, naming the last reported file, if the work fails in another
// way, exceeds the memory or the time, or ends its process. Throws Cancelled soon after a stop is
// requested.
std::string RunInChildProcess(const std::function<std::string(const ReportFile&)>& work,
                              const ChildRights& rights, const std::stop_token& stop);

}  // namespace semblance::problems
