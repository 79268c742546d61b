// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the trials of a study. Each is one folder, written whole or not at all, so that a study that
// was killed goes on where it was, and shards of it can run anywhere.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "problems/study/study_plan.h"
#include "problems/study/study_progress.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// What is run although it is there: trials that failed; those that are not usable too; all.
enum class Rerun { kNothing, kFailed, kUnusable, kAll };

struct StudyRunOptions {
  int jobs = 1;   // trials at a time, each on one thread
  int shard = 0;  // of shards: trials n with n % shards == shard
  int shards = 1;
  Rerun rerun = Rerun::kNothing;
  std::string only = {};             // a condition for the trials to run (SelectTrials); empty: all
  std::filesystem::path cache = {};  // folder for implicit faces, shared by processes; empty: none
  int cache_limit_mb = 2000;
  // May be empty. Called from one thread at a time: each second, and after each trial with its
  // subject, values and status.
  std::function<void(const StudyEta&, const std::string& trial)> on_progress = {};
};

struct StudySummary {
  int trials = 0;   // of this shard, of those that were asked for
  int skipped = 0;  // were there already
  int done = 0, failed = 0;
  int left_over = 0;     // trials of an earlier plan in this folder that are none of this one
  bool changed = false;  // the folder held an earlier plan
  int shared_made = 0;  // subjects, shells, skulls with their implicit face, and generic faces that
                        // were made; each serves all trials that have it in common
};

// In `folder`: plan.json (all trials), trials/<id>/trial.json (status, axes, metrics, resolved
// experiment, versions; the same bytes whenever and wherever it ran) and timing.json; with
// `keep: view` scene.json (of a study of depth: the first subject's depth.png), with `keep: run`
// all files of a run beside them. A trial that cannot be done is a trial.json with the reason. What
// trials have in common is made once.
//
// The study may have changed since: a trial that is there and still in the plan is taken as it is
// (its trial.json then lists the axes of the changed study), unless it lacks the files that `keep`
// asks for now; one that is no longer in the plan stays where it is and is in no table. Throws
// IoError if the folder cannot be written or holds a plan that shares no trial with this one,
// InputError as SelectTrials, Cancelled on request (after the trials at
// hand).
StudySummary RunStudy(const StudyPlan& plan, const std::filesystem::path& folder,
                      const StudyRunOptions& options, const RunContext& context);

// Copies finished trials from other folders of the same plan, each whole or not at all; those that
// are there already stay. Returns a line for each that is not taken, as CopyTrial says. Throws
// IoError if a folder is of another plan.
std::vector<std::string> GatherTrials(const std::filesystem::path& folder,
                                      const std::vector<std::filesystem::path>& others);

}  // namespace semblance
