// SPDX-License-Identifier: GPL-3.0-or-later
// A study (study_file.h) as a plan: the table of its trials. The whole plan is expanded and checked
// before any trial runs.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "problems/experiment/experiment.h"
#include "problems/experiment/input_contents.h"
#include "problems/study/study_file.h"
#include "problems/study/study_plugins.h"

namespace semblance::problems {

// One trial: the experiment that a subject and a row of settings make.
struct StudyTrial {
  // 12 hex digits of a hash over the resolved experiment with the contents of its input files
  // (input_contents.h), over the job if it is not `face`, over the gallery if there is one, and
  // over the sources of the caller's scheme and metrics: the same id on every machine.
  std::string id;
  std::string subject;              // name in the study
  std::vector<std::string> values;  // one per axis, as short text; empty if the row does not set it
  Experiment experiment;
  std::vector<std::string> tags = {};  // tags of the subject
};

// A person of the gallery (`job: identify`), with the experiment that names the true skin.
struct GalleryEntry {
  std::string name;
  Experiment experiment;
};

// The contents of all inputs as the ids of the trials have them, by option and path.
struct InputContents {
  InputHashes by_input;
  std::shared_ptr<FileHashes> hashes = std::make_shared<FileHashes>();
};

struct StudyPlan {
  std::string title = "untitled";
  std::string metric = "face.rms_mm";
  TrialFiles keep = TrialFiles::kSummary;
  StudyJob job = StudyJob::kFace;
  std::vector<std::string> tags = {};
  std::vector<std::string> axes = {};       // option paths, in the order of the file
  std::vector<StudyTrial> trials = {};      // subject by subject
  std::vector<std::string> notes = {};      // e.g. subjects that were skipped
  std::string hash = {};                    // hash of all ids, in order
  IdentifyOptions identify = {};            // options of `job: identify`
  std::vector<GalleryEntry> gallery = {};   // the subjects whose files exist, then the others
  std::vector<OwnMetric> own_metrics = {};  // measured in each trial
  InputContents contents = {};
};

// If all subjects are optional and lack files: a fault, or only a note, for `semblance check`.
enum class WithoutSubjects { kFault, kNote };

// Reads and expands a study. Throws IoError if the file cannot be read. Throws ConfigError with all
// faults, each once and with its line: faults of the file and of every trial's experiment, a metric
// that no trial can have, and trials that are the same experiment; at once if the study names
// plugins that the caller has not loaded. Without subjects (kNote) the plan has no trials. Throws
// InputError for a scheme or a metric of the caller whose name cannot be used.
StudyPlan ReadStudy(const std::filesystem::path& file,
                    WithoutSubjects without_subjects = WithoutSubjects::kFault,
                    const StudyPlugins& plugins = {});

// Returns, per trial, whether the condition (value_filter.h) holds; an empty condition always
// holds. Its names are `subject`, `tag`, `id` and the axes, with the values of the plan. Throws
// InputError as ValueFilter does, and if the condition holds for no trial.
std::vector<bool> SelectTrials(const StudyPlan& plan, const std::string& condition);

}  // namespace semblance::problems
