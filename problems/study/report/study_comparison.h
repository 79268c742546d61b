// SPDX-License-Identifier: GPL-3.0-or-later
// Comparison of several studies over the subjects that they share, and agreement of their rankings.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/experiment/metrics/statistics.h"
#include "problems/study/study_file.h"
#include "problems/study/study_tables.h"

namespace semblance::problems {

struct NamedStudy {
  std::string name;  // unique
  StudyResults results;
  std::filesystem::path folder = {};
};

// The results in each folder. A study is named by its folder, and by more of the path if two
// folders have the same name. `metric` is the number to compare; empty: that of each study. Throws
// IoError as ReadStudyResults and for a damaged trial, and InputError if a folder appears twice.
std::vector<NamedStudy> ReadStudies(const std::vector<std::filesystem::path>& folders,
                                    const std::string& metric = {});

// A treatment of one study, over the subjects that all studies have.
struct ComparedTreatment {
  std::string study, label;
  std::map<std::string, double> by_subject;  // the metric
  SampleSummary summary;                     // of the metric
};

// Two treatments over the subjects that both have.
struct TreatmentPair {
  ComparedTreatment reference, other;
  bool same_label = false;    // the treatments have the same label
  int better = 0, worse = 0;  // subjects for which `other` is better or worse
  SampleSummary difference;   // other minus reference (Preference::Compared), over common subjects
  WilcoxonResult test;        // of the differences; none below 6 subjects
  double p_holm = kNaN;       // adjusted for all pairs (Holm 1979); NaN below 6 subjects
};

struct StudyComparison {
  std::string metric;
  Preference preference = {};
  std::vector<std::string> studies;
  std::vector<std::string> subjects;          // that all studies have, sorted
  std::vector<ComparedTreatment> treatments;  // study by study, best mean first
  std::vector<TreatmentPair> pairs;           // those of the same label first
  std::vector<std::string> notes;             // left-out subjects and trials
};

// The treatments that are paired. kAll: every two of them, the earlier one as the reference.
// kMatched: each treatment of a later study with the one of the same label in the first study, else
// with the best of the first study. Fewer pairs make Holm's correction milder.
enum class ComparedPairs { kAll, kMatched };

struct CompareOptions {
  std::string metric;            // a path in result.json; empty: the first study's metric
  std::optional<Better> better;  // none: CommonPreference
  ComparedPairs pairs = ComparedPairs::kAll;
};

// The direction in which the studies that use this metric rank it. DefaultBetter if no study uses
// it. Throws InputError if the studies contradict each other.
Better CommonPreference(std::span<const NamedStudy* const> studies, const std::string& metric);

// Pairs the treatments of one study or more. The unit is the subject, identified by its name.
// Throws InputError without a study, for one study with kMatched, if no subject is in all studies,
// if a study has no number of that name, if there are more than 5,000 pairs, or if the studies
// contradict each other and `better` is empty.
StudyComparison CompareStudies(std::span<const NamedStudy> studies, const CompareOptions& options);

// ---------------------------------------------------------------------------------------------
// Rank agreement
// ---------------------------------------------------------------------------------------------

struct RankedTreatment {
  std::string label;
  double reference_mean = kNaN, mean = kNaN;  // of the metric, each over its study's own subjects
  double reference_rank = kNaN, rank = kNaN;  // 1 is best; ties get mean ranks
};

struct RankAgreement {
  std::string metric, reference, study;
  Preference preference = {};
  std::vector<RankedTreatment> treatments;  // labels of both studies, best of the reference first
  double spearman = kNaN;                   // rank correlation, -1 to 1; NaN below 3 treatments
};

// Do two studies put the same treatments into the same order? Their subjects may differ, e.g.
// phantoms and people. Each study's means are over the subjects that have all common treatments.
// Throws InputError as CompareStudies, and if the studies have fewer than three treatments in
// common.
RankAgreement CompareRanks(const NamedStudy& reference, const NamedStudy& other,
                           const CompareOptions& options);

// For a terminal: one line per treatment, then the correlation.
std::string RankText(const RankAgreement& agreement);

}  // namespace semblance::problems
