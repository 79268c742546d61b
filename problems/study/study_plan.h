// SPDX-License-Identifier: GPL-3.0-or-later
// A study (study_file.h) as a plan: the table of its trials. It is expanded and checked as a whole
// before anything runs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/study/study_trial.h"

namespace semblance {

// A person of the gallery (`job: identify`), as the experiment that has the true skin.
struct GalleryEntry {
  std::string name;
  Experiment experiment;
};

struct StudyPlan {
  std::string title = "untitled";
  std::string metric = "face.rms_mm";
  TrialFiles keep = TrialFiles::kSummary;
  StudyJob job = StudyJob::kFace;
  std::vector<std::string> tags = {};
  std::vector<std::string> axes = {};      // option paths, in the order of the file
  std::vector<StudyTrial> trials = {};     // subject by subject
  std::vector<std::string> notes = {};     // e.g. subjects that were skipped
  std::string hash = {};                   // of all ids, in order
  IdentifyOptions identify = {};           // of that job
  std::vector<GalleryEntry> gallery = {};  // the subjects that are left, then the others
  std::string common = {};                 // what the ids of all trials hold (TrialId)
};

// Where all subjects are optional and lack files: a fault, or a note, for who only looks whether
// the study is right.
enum class WithoutSubjects { kFault, kNote };

// Throws IoError if the file cannot be read; ConfigError with all faults, each once and at its
// line: those of the file, of every trial's experiment, a metric that no trial can have, and trials
// that are the same experiment. Without subjects (kNote) the plan has no trials.
StudyPlan ReadStudy(const std::filesystem::path& file,
                    WithoutSubjects without_subjects = WithoutSubjects::kFault);

// Which of the trials a condition (value_filter.h) holds for; all for an empty one. Its names are
// `subject`, `tag`, `id` and the axes; values are those of the plan. Throws InputError as
// ValueFilter does, and if it holds for none.
std::vector<bool> TrialsThat(const StudyPlan& plan, const std::string& condition);

}  // namespace semblance
