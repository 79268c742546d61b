// SPDX-License-Identifier: GPL-3.0-or-later
// A study (study_file.h) as a plan: the table of its trials. It is expanded and checked as a whole
// before anything runs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/pipeline/experiment.h"
#include "problems/study/study_file.h"

namespace semblance {

struct StudyTrial {
  std::string id;       // 12 hex digits of the hash of the resolved experiment, its input files by
                        // content: the same on every machine; with the job where it is not `face`,
                        // and the gallery where there is one
  std::string subject;  // its name in the study
  std::vector<std::string> values;  // one per axis, as short text; empty where the row has none
  Experiment experiment;
  std::vector<std::string> tags = {};  // of its subject
};

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
};

// Throws IoError if the file cannot be read; ConfigError with all faults, each once and at its
// line: those of the file, of every trial's experiment, a metric that no trial can have, and trials
// that are the same experiment.
StudyPlan ReadStudy(const std::filesystem::path& file);

// Which of the trials a condition (value_filter.h) holds for; all for an empty one. Its names are
// `subject`, `tag`, `id` and the axes; values are those of the plan. Throws InputError as
// ValueFilter does, and if it holds for none.
std::vector<bool> TrialsThat(const StudyPlan& plan, const std::string& condition);

}  // namespace semblance
