// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the subjects of a population. Each is one file, written whole or not at all, so that a
// population that was killed goes on where it was, and shards of it can run anywhere.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/subject_depths.h"

namespace semblance {

struct PopulationRunOptions {
  int jobs = 1;               // subjects at a time
  int shard = 0, shards = 1;  // of subjects n with n % shards == shard
  bool rerun_failed = false;
  // May be empty. Called from one thread at a time, after each subject.
  std::function<void(int done, int of, const std::string& name, const std::string& status)>
      on_progress = {};
};

struct PopulationRunSummary {
  int subjects = 0;  // of this shard
  int skipped = 0;   // were there already
  int done = 0, failed = 0;
};

// Writes subjects/<id>.json into `folder` for each subject of the shard that is not there: its
// depths, or why it has none. The same bytes whatever the number of jobs and threads. Throws
// IoError if the folder cannot be written; Cancelled on request, after the subjects at hand.
PopulationRunSummary MeasurePopulation(const PopulationPlan& plan,
                                       const std::filesystem::path& folder,
                                       const PopulationRunOptions& options,
                                       const RunContext& context);

struct MeasuredSubject {
  PopulationSubject person;
  std::string id;
  std::string status = "missing";  // done, failed or missing
  std::string reason = {};         // of a failure
  SubjectDepths depths = {};       // where done
};

// All subjects of the plan as they lie in the folder.
std::vector<MeasuredSubject> ReadMeasured(const PopulationPlan& plan,
                                          const std::filesystem::path& folder);

// What another folder gave.
struct GatheredFrom {
  std::filesystem::path folder;
  int held = 0;   // subjects of the plan that it has
  int taken = 0;  // of these, those that were lacking
};

// Copies the files of subjects of the plan that `folder` lacks from other folders, the first that
// has one. Throws IoError, before anything is copied, for one that is not there or has no
// subjects/.
std::vector<GatheredFrom> GatherSubjects(const PopulationPlan& plan,
                                         const std::filesystem::path& folder,
                                         const std::vector<std::filesystem::path>& others);

// Throws IoError if the folder holds anything but this population: files and no measured subject;
// subjects of which none is in the plan; or the results of a population of another title or id. One
// that is empty or not there holds nothing.
void RefuseOtherFolder(const PopulationPlan& plan, const std::filesystem::path& folder);

}  // namespace semblance
