// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers of a study's folder: read from its trials, written as tables.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "problems/metrics/statistics.h"
#include "problems/study/study_metrics.h"
#include "surfaces/base/geometry.h"

namespace semblance {

struct TrialRow {
  std::string id, subject;
  std::vector<std::string> values;        // one per axis
  std::string status;                     // done, unusable, failed, missing
  std::string reason;                     // of a failure
  std::map<std::string, double> metrics;  // by dotted path in result.json; finite ones only
  std::vector<double> quantiles_mm = {};  // of the face's error (FaceMetrics); empty: none
  std::vector<double> step_rms_mm = {};   // before the first step of the fit, after each
  // Of stated standard deviations (interp/evaluation/calibration.h): against the true depth,
  // against dowels that were left out.
  std::vector<double> depth_coverage = {}, left_out_coverage = {};
  // Of its timing.json: work that another trial did for it is not in it. NaN: not told. It is in no
  // table that is the same in every run.
  double wall_s = kNaN;
  std::vector<double> depth_pit = {}, left_out_pit = {};  // the same as shares by bin (scores.h)
};

struct StudyResults {
  std::string title, hash, metric;
  std::vector<std::string> axes;
  std::vector<TrialRow> trials;    // in the order of the plan
  std::vector<std::string> notes;  // of the plan; AreaNotes; the tags
  std::vector<std::string> tags = {};
  Preference preference = {};  // of the metric

  int Count(const std::string& status) const;
  // Does a trial that is done have the metric?
  bool HasMetric() const;
};

// Throws IoError if plan.json is missing or not that of a study.
StudyResults ReadStudyResults(const std::filesystem::path& folder);

// Where the treatments were measured on unlike areas of one subject (by more than 0.5 %): one line
// that says so and whose, for their difference is then not that of the treatments alone. Empty
// where all areas are alike, or where the metric has none.
std::vector<std::string> AreaNotes(const StudyResults& results);

// One treatment: the trials that differ in the subject only.
struct Treatment {
  std::vector<std::string> values;           // one per axis
  std::string label;                         // TreatmentLabel of them
  std::vector<std::size_t> trials;           // those that are done, in the order of the plan
  std::map<std::string, double> by_subject;  // the metric, of these
};
// The title, where the study sets one, else all values that are not empty.
std::string TreatmentLabel(const std::vector<std::string>& axes,
                           const std::vector<std::string>& values);
std::vector<Treatment> Treatments(const StudyResults& results, const std::string& metric);

// trials.csv: trial, subject, the axes, status, reason, metric, value; one line a number, in the
// order of the plan. summary.csv: the axes, metric, n, mean, sd, median, min, max and the
// bootstrap's 95 % interval of the mean over subjects.
std::string TrialsCsv(const StudyResults& results);
std::string SummaryCsv(const StudyResults& results);

}  // namespace semblance
