// SPDX-License-Identifier: GPL-3.0-or-later
// A study on a Slurm cluster: an array of shards, then the merge. All jobs write to one folder,
// which every node must see.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semblance::problems {

struct SubmitOptions {
  std::filesystem::path program;    // path of semblance on the nodes
  std::filesystem::path study;      // its YAML file
  std::filesystem::path folder;     // for the results
  int shards = 8;                   // number of elements of the array, >= 1
  int jobs = 1;                     // trials at a time and processors per element, >= 1
  std::vector<std::string> sbatch;  // further options of sbatch, e.g. "--partition=long"
};

// Writes a shell script that submits the array, submits the merge to run after it, and prints both
// job numbers. The script may run again: finished trials are skipped. If a node is lost, Slurm
// queues its element again, which continues where it was.
std::string SubmitScript(const SubmitOptions& options);

// Writes the script as submit.sh into the folder and runs it. Returns its path. Throws IoError if
// the script cannot be written, and InputError if there is no sbatch or sbatch fails; the script
// stays.
std::filesystem::path SubmitStudy(const SubmitOptions& options);

}  // namespace semblance::problems
