// SPDX-License-Identifier: GPL-3.0-or-later
// One trial of a study: the experiment that a subject and a row of settings make, and its id.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/output/file_hashes.h"
#include "problems/pipeline/experiment.h"
#include "problems/study/study_rows.h"

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

// A subject of the study, with the experiment that its trials vary.
struct SubjectTree {
  std::string name;
  ConfigNode tree;
  bool optional = false;
  std::vector<std::string> tags = {};
};

// Faults of many trials: they share most, and each is told once.
class TrialFaults {
 public:
  void Add(const std::string& line);
  void Add(const ConfigErrors& errors);
  // Throws ConfigError with a line per fault.
  void ThrowIfAny() const;

 private:
  std::vector<std::string> lines_;
};

// Without an id. `axes` holds the paths that the row sets.
StudyTrial MakeTrial(const SubjectTree& subject, const StudyRow& row,
                     const std::vector<std::string>& axes, const ConfigNode& defaults,
                     TrialFaults& faults);

// The hash of a resolved experiment, each input file in it by its content.
class ExperimentHash {
 public:
  std::string operator()(const Experiment& experiment);
  static constexpr std::size_t kIdDigits = 12;

 private:
  std::string HashOf(const std::filesystem::path& file);
  FileHashes files_;
};

// `common`: what the results of the study's trials rest on beside their experiments; empty for
// job: face.
std::string TrialId(const Experiment& experiment, const std::string& common, ExperimentHash& hash);

}  // namespace semblance
