// SPDX-License-Identifier: GPL-3.0-or-later
// A study on a cluster that Slurm runs: an array of shards, then the merge. All of them write to
// one folder, which every node must see.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semblance {

struct SubmitOptions {
  std::filesystem::path program;  // semblance itself, as the nodes see it
  std::filesystem::path study;    // its YAML file
  std::filesystem::path folder;   // for the results
  int shards = 8;                 // elements of the array, >= 1
  int jobs = 1;                   // trials at a time in each, >= 1; so many processors it asks for
  std::vector<std::string> sbatch;  // further options of sbatch, e.g. "--partition=long"
};

// A shell script that submits the array and the merge, which waits for it, and prints the two job
// numbers. Run again it submits again, and what is done is skipped. An element whose node is lost
// is queued anew by Slurm and goes on where it was.
std::string SubmitScript(const SubmitOptions& options);

// Writes the script as submit.sh into the folder and runs it. Returns its path. Throws IoError if
// it cannot be written, InputError if there is no sbatch here or it refuses; the script stays.
std::filesystem::path SubmitStudy(const SubmitOptions& options);

}  // namespace semblance
