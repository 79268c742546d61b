// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers of a study's folder, read from its trials and written as tables.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "problems/experiment/metrics/statistics.h"
#include "problems/study/study_metrics.h"
#include "problems/study/trial_folder.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

struct TrialRow {
  std::string id, subject;
  std::vector<std::string> values;        // one per axis
  std::string status;                     // done, unusable, failed, damaged, missing
  std::string reason;                     // why it failed, or is unusable or damaged
  NamedNumbers metrics;                   // by dotted path in result.json; finite ones only
  std::vector<double> quantiles_mm = {};  // of the face's error (FaceMetrics); empty: none
  std::vector<double> step_rms_mm = {};   // before the first step of the fit, after each
  // Calibration of the stated standard deviations (interp/evaluation/calibration.h): shares within
  // nominal intervals, against the true depth and against left-out dowels.
  std::vector<double> depth_coverage = {}, left_out_coverage = {};
  // From timing.json, or NaN. Work shared with an earlier trial is not included. No table that must
  // be the same in every run contains it.
  double wall_s = kNaN;
  std::vector<double> depth_pit = {}, left_out_pit = {};  // the same as PIT histograms (scores.h)
  // The version that made the trial if it is not this one ("0.0.1"), or "another build of 1.0.0";
  // empty: this program made it.
  std::string made_by_other = {};
};

struct StudyResults {
  std::string title, hash, metric;
  std::vector<std::string> axes;
  std::vector<TrialRow> trials;    // in the order of the plan
  std::vector<std::string> notes;  // notes of the plan, AreaNotes, the tags
  std::vector<std::string> tags = {};
  Preference preference = {};  // which values of the metric are better

  int Count(const std::string& status) const;
  // Returns true if a trial that is done has the metric.
  bool HasMetric() const;
};

// A study of more trials keeps, of the numbers of each trial, only those of the groups of its
// metric (for face.rms_mm: face.rms_mm, face.median_mm and so on), with a note. All numbers of
// 100,000 trials would take tables of several gigabytes.
inline constexpr std::size_t kMostTrialsInFull = 5000;

// Reads the plan of a study's folder: its trials, without their status and numbers. Throws IoError
// if plan.json is missing or is not the plan of a study.
StudyResults ReadStudyRows(const std::filesystem::path& folder);

// Reads a study's folder. A trial that is not sound (trial_folder.h) is `damaged` and has no
// numbers. `further` is another metric that is kept in a large study; it may be empty. Throws
// IoError as ReadStudyRows.
StudyResults ReadStudyResults(const std::filesystem::path& folder,
                              TrialCheck check = TrialCheck::kSizes,
                              const std::string& further = {});

// Returns notes on trials that this program did not make, one line per version: "4 of 6 trials were
// made by version 0.0.1 ...". Such numbers may differ for another reason than the treatments.
std::vector<std::string> VersionNotes(const StudyResults& results);

// Returns a line on trials that are done but have no finite number for the metric, so that they do
// not count in the ranking; empty if there is none.
std::string MissingMetricText(const StudyResults& results);

// Returns a line that names the damaged trials; empty if there is none.
std::string DamageText(const StudyResults& results);

// Returns a note if the treatments of a subject were measured on areas that differ by more than
// 0.5 %, because their errors then differ for another reason than the treatments. Empty if all
// areas agree, or if the metric has no area.
std::vector<std::string> AreaNotes(const StudyResults& results);

// One treatment: the trials that differ only in the subject.
struct Treatment {
  std::vector<std::string> values;           // one per axis
  std::string label;                         // TreatmentLabel of the values
  std::vector<std::size_t> trials;           // the trials that are done, in the order of the plan
  std::map<std::string, double> by_subject;  // the metric of these trials
  int unusable = 0;                          // trials that ran, but whose result is not usable
};
// Returns the title if the study sets one, else all values that are not empty.
std::string TreatmentLabel(const std::vector<std::string>& axes,
                           const std::vector<std::string>& values);
std::vector<Treatment> Treatments(const StudyResults& results, const std::string& metric);

// Writes trials.csv, with one line per number in the order of the plan: trial, subject, the axes,
// status, reason, metric, value.
std::string TrialsCsv(const StudyResults& results);
// Writes trials_wide.csv, with one line per trial in the order of the plan: trial, subject, the
// axes, status, reason, then a column for each metric that any trial has, sorted by name. A number
// that a trial lacks is an empty cell.
std::string TrialsWideCsv(const StudyResults& results);
// One line on the trials whose results are not usable, by treatment: no ranking, mean or test
// counts them. Empty if there are none.
std::string UnusableText(const StudyResults& results);

// Writes summary.csv: the axes, metric, n, mean, sd, median, min, max, the bootstrap's 95 %
// interval of the mean over subjects, the number of trials that are left out as not usable, and the
// number of subjects that all treatments with this metric have (n_common), with the mean over them:
// only this mean may be compared if trials are missing.
std::string SummaryCsv(const StudyResults& results);

}  // namespace semblance::problems
