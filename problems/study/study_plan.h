// SPDX-License-Identifier: GPL-3.0-or-later
// A study: many experiments in one file. It is expanded and checked as a whole before anything
// runs.
//
//     title: ...
//     base: ../phantom.yaml            # the experiment that the trials vary
//     set: {implicit.resolution: 75}   # for all trials
//     subjects:                        # each with what it changes; without it, the base's own
//       - {name: a, set: {subject.random_seed: 1}}
//       - {name: b, base: ../cranium.yaml, optional: true}   # skipped where its files are missing
//     grid: {interp: [nearest, mean], implicit.resolution: [40, 60]}   # every combination
//     zip: {fit.features: [restore, free], title: [a, b]}              # side by side
//     list: [{seeds.level: 1}, {seeds.level: 2, rounds: 2}]            # by hand
//     sample: {method: lhs, n: 20, random_seed: 1, ranges: {seeds.weight: [0.1, 1.0]}}
//     metric: face.rms_mm              # that the report ranks by; lower is better
//     keep: summary                    # view: and what the report's 3-D view needs; run: all files
//     job: face                        # depth: the interpolated depth alone, without a fit; then
//                                      # view keeps pictures of the first subject's depth maps
//
// Each of grid, zip, list and sample gives rows; a trial is a subject with one row of each. A value
// is any part of an experiment, be it a number or a whole strategy.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "problems/pipeline/experiment.h"

namespace semblance {

enum class TrialFiles { kSummary, kView, kRun };
constexpr auto EnumNames(TrialFiles) {
  return std::to_array<std::string_view>({"summary", "view", "run"});
}

enum class StudyJob { kFace, kDepth };
constexpr auto EnumNames(StudyJob) { return std::to_array<std::string_view>({"face", "depth"}); }

struct StudyTrial {
  std::string id;       // 12 hex digits of the hash of the resolved experiment, its input files by
                        // content: the same on every machine
  std::string subject;  // its name in the study
  std::vector<std::string> values;  // one an axis, as short text; empty where the row has none
  Experiment experiment;
};

struct StudyPlan {
  std::string title = "untitled";
  std::string metric = "face.rms_mm";
  TrialFiles keep = TrialFiles::kSummary;
  StudyJob job = StudyJob::kFace;
  std::vector<std::string> axes;   // option paths, in the order of the file
  std::vector<StudyTrial> trials;  // subject by subject
  std::vector<std::string> notes;  // e.g. subjects that were skipped
  std::string hash;                // of all ids, in order
};

// Throws IoError if the file cannot be read; ConfigError with all faults, each at its line: those
// of the file, of every trial's experiment, and trials that are the same experiment.
StudyPlan ReadStudy(const std::filesystem::path& file);

// The files that an experiment reads.
std::vector<std::filesystem::path> InputFilesOf(const Experiment& experiment);

}  // namespace semblance
