// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the trials of a study. Each trial is one folder, which is complete or counts as missing, so
// that a killed study continues where it was, and its shards can run on any machine. study_run.cc
// begins with the states of a trial and the invariants.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "problems/study/study_plan.h"
#include "problems/study/study_progress.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

// The finished trials that run again: none; those that failed; also the unusable ones; those that
// another version or build of the program made; all. A damaged trial always runs again.
enum class Rerun { kNothing, kFailed, kUnusable, kOtherVersions, kAll };

// Reads "failed", "unusable", "other-versions" or "all"; "" is kNothing. Throws ConfigError.
Rerun ParseRerun(const std::string& name);

struct StudyRunOptions {
  int jobs = 1;   // number of trials at a time, each on one thread
  int shard = 0;  // runs the trials n with n % shards == shard
  int shards = 1;
  Rerun rerun = Rerun::kNothing;
  std::string only = {};             // condition of SelectTrials; empty: all trials
  std::filesystem::path cache = {};  // folder of implicit faces, shared by processes; empty: none
  int cache_limit_mb = 2000;
  // May be empty. Called by one thread at a time: each second with an empty `trial`, and after each
  // trial with its subject, values and status.
  std::function<void(const StudyEta&, const std::string& trial)> on_progress = {};
};

struct StudySummary {
  int trials = 0;   // number of selected trials of this shard
  int skipped = 0;  // existed before
  int done = 0, failed = 0;
  std::vector<std::string> damaged = {};  // trials that ran again for this reason, a line each
  int left_over = 0;     // trials of an earlier plan in this folder that are not in this plan
  bool changed = false;  // the folder held an earlier plan
  // Number of subjects, shells, skulls with their implicit face, and generic faces that were made.
  // Each is shared by all trials that need it.
  int shared_made = 0;
};

// Runs the trials that are not finished. Writes to `folder`:
//   plan.json              all trials of the plan
//   trials/<id>/trial.json status, axes, metrics, resolved experiment, versions; the same bytes
//                          whenever and wherever the trial ran. A trial that fails has the reason.
//   trials/<id>/timing.json
//   trials/<id>/...        with `keep: view` scene.json (a study of depth: depth.png, for the first
//                          subject); with `keep: run` all files of a run
// Parts that several trials share are made once.
//
// The study may have changed since the last call. A finished trial that is still in the plan is
// kept (its trial.json then gets the axes of the changed study), unless it lacks files that `keep`
// requests now, or a file of it is damaged. A trial that is no longer in the plan stays on disk and
// appears in no table. Throws IoError if the folder cannot be written or holds a plan that shares
// no trial with this one, or if an input file changes during the work; InputError as SelectTrials
// does, and Cancelled on request.
StudySummary RunStudy(const StudyPlan& plan, const std::filesystem::path& folder,
                      const StudyRunOptions& options, const RunContext& context);

// Copies finished trials from other folders of the same plan, each completely or not at all. Sound
// trials in `folder` stay. Returns one line per trial that was not copied, with the reason of
// CopyTrial. Throws IoError if a folder has another plan.
std::vector<std::string> GatherTrials(const std::filesystem::path& folder,
                                      const std::vector<std::filesystem::path>& others);

}  // namespace semblance::problems
