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
                        // content: the same on every machine; with the gallery where there is one
  std::string subject;  // its name in the study
  std::vector<std::string> values;  // one per axis, as short text; empty where the row has none
  Experiment experiment;
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
  std::vector<std::string> axes = {};      // option paths, in the order of the file
  std::vector<StudyTrial> trials = {};     // subject by subject
  std::vector<std::string> notes = {};     // e.g. subjects that were skipped
  std::string hash = {};                   // of all ids, in order
  IdentifyOptions identify = {};           // of that job
  std::vector<GalleryEntry> gallery = {};  // the subjects that are left, then the others
};

// Throws IoError if the file cannot be read; ConfigError with all faults, each at its line: those
// of the file, of every trial's experiment, and trials that are the same experiment.
StudyPlan ReadStudy(const std::filesystem::path& file);

// The files that an experiment reads.
std::vector<std::filesystem::path> InputFilesOf(const Experiment& experiment);

}  // namespace semblance
