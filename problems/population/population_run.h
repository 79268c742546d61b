// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the subjects of a population. The result of each subject is one file, written completely
// or not at all. A killed run therefore continues where it stopped, and shards can run on any
// machine.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/subject_depths.h"

namespace semblance::problems {

struct PopulationRunOptions {
  int jobs = 1;               // subjects at a time
  int shard = 0, shards = 1;  // measures the subjects n with n % shards == shard
  bool rerun_failed = false;
  // May be empty. Called from one thread at a time, after each subject.
  std::function<void(int done, int of, const std::string& name, const std::string& status)>
      on_progress = {};
};

struct PopulationRunSummary {
  int subjects = 0;  // subjects of this shard
  int skipped = 0;   // subjects that had a result already
  int done = 0, failed = 0;
};

// Measures each subject of the shard that has no result yet and writes subjects/<id>.json into
// `folder`: its depths, or the reason why it has none. The bytes do not depend on the number of
// jobs and threads. Throws IoError if the folder cannot be written. On a stop request, finishes the
// subjects that are being measured and throws Cancelled.
PopulationRunSummary MeasurePopulation(const PopulationPlan& plan,
                                       const std::filesystem::path& folder,
                                       const PopulationRunOptions& options,
                                       const RunContext& context);

struct MeasuredSubject {
  PopulationSubject person;
  std::string id;
  std::string status = "missing";  // done, failed or missing
  std::string reason = {};         // reason of a failure
  SubjectDepths depths = {};       // set if done
};

// Reads the results of all subjects of the plan from the folder.
std::vector<MeasuredSubject> ReadMeasured(const PopulationPlan& plan,
                                          const std::filesystem::path& folder);

// The subjects that were copied from another folder.
struct GatheredFrom {
  std::filesystem::path folder;
  int held = 0;   // subjects of the plan that the folder has
  int taken = 0;  // subjects that were missing and were copied
};

// Copies the results of subjects of the plan that `folder` lacks from the first of the other
// folders that has them. Throws IoError, before anything is copied, if another folder does not
// exist or has no subjects/.
std::vector<GatheredFrom> GatherSubjects(const PopulationPlan& plan,
                                         const std::filesystem::path& folder,
                                         const std::vector<std::filesystem::path>& others);

// Throws IoError if the folder contains anything other than this population: files without a
// measured subject, measured subjects of which none is in the plan, or results with another title
// or id. A folder that is empty or does not exist is accepted.
void RefuseOtherFolder(const PopulationPlan& plan, const std::filesystem::path& folder);

}  // namespace semblance::problems
