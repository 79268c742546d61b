// SPDX-License-Identifier: GPL-3.0-or-later
// Several studies side by side: what was better, over the subjects that they share.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/metrics/statistics.h"
#include "problems/study/study_file.h"
#include "problems/study/study_tables.h"

namespace semblance {

struct NamedStudy {
  std::string name;  // no two alike
  StudyResults results;
  std::filesystem::path folder = {};
};

// The results in each folder, called by the folder's name; by as much of the path as tells them
// apart, where two are called alike. Throws IoError as ReadStudyResults, InputError if a folder
// appears twice.
std::vector<NamedStudy> ReadStudies(const std::vector<std::filesystem::path>& folders);

// A treatment of one study, over the subjects that all studies have.
struct ComparedTreatment {
  std::string study, label;
  std::map<std::string, double> by_subject;  // the metric
  SampleSummary summary;                     // of these
};

// A treatment of a later study against one of the first.
struct TreatmentPair {
  ComparedTreatment reference, other;
  bool same_label = false;    // else the reference is the best of the first study
  int better = 0, worse = 0;  // subjects of which the other has the better or the worse metric
  SampleSummary difference;   // other less reference (Preference::Compared), over the subjects that
                              // both have
  WilcoxonResult test;        // of the differences; none below 6 subjects
  double p_holm = kNaN;       // adjusted for all pairs (Holm 1979); NaN below 6 subjects
};

struct StudyComparison {
  std::string metric;
  Preference preference = {};
  std::vector<std::string> studies;
  std::vector<std::string> subjects;          // that all studies have, sorted
  std::vector<ComparedTreatment> treatments;  // study by study, best mean first
  std::vector<TreatmentPair> pairs;           // in the order of the later studies' treatments
  std::vector<std::string> notes;             // what a reader should know
};

struct CompareOptions {
  std::string metric;            // a number of result.json by its path; empty: the first study's
  std::optional<Better> better;  // none: as the studies of this metric took it, else BetterOf
};

// What the studies of this metric took as better; where none is of it, BetterOf. Throws InputError
// if they contradict each other.
Better BetterIn(std::span<const NamedStudy* const> studies, const std::string& metric);

// A treatment of a later study is paired with the one of the same label in the first, else with the
// best of the first. The unit is the subject, by its name. Throws InputError for fewer than two
// studies, if no subject is in all of them, if a study has no number of that name, or if one study
// took other values of the metric as better than another one, and `better` does not say.
StudyComparison CompareStudies(std::span<const NamedStudy> studies, const CompareOptions& options);

}  // namespace semblance
