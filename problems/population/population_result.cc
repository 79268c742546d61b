// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr std::size_t kFewest = 3;

std::vector<CountedSubject> Counted(const PopulationResult& result) {
  std::vector<CountedSubject> counted;
  for (const int at : result.counted) {
    counted.push_back({result.subjects[at].person, result.subjects[at].depths});
  }
  return counted;
}

void CheckEnough(const PopulationResult& result) {
  if (result.counted.size() < kFewest) {
    throw InputError(fmt::format(
        "{}: {} subjects are measured ({} failed, {} missing); a population needs at least {}",
        result.file.title, result.counted.size(), result.Count("failed"), result.Count("missing"),
        kFewest));
  }
}

// Finds them, and leaves them out if they are to be. `subject` becomes that of all subjects.
void LookForOutliers(PopulationResult& result) {
  result.outliers = FindOutliers(result.sample, result.joint, result.file.outliers);
  std::set<int> gone;
  for (Outlier& outlier : result.outliers) {
    if (outlier.site.empty()) {
      gone.insert(outlier.subject);
    }
  }
  if (result.file.outliers.leave_out && !result.outliers.empty()) {
    result.sample = WithoutOutliers(std::move(result.sample), result.outliers);
    std::vector<Eigen::Index> kept;
    std::vector<int> counted;
    for (int row = 0; row < static_cast<int>(result.counted.size()); ++row) {
      if (!gone.contains(row)) {
        kept.push_back(row);
        counted.push_back(result.counted[row]);
      }
    }
    result.sample.values = Eigen::MatrixXd(result.sample.values(kept, Eigen::all));
    for (Outlier& outlier : result.outliers) {
      outlier.subject = result.counted[outlier.subject];
    }
    result.counted = counted;
    CheckEnough(result);
    result.joint = FitPopulation(result.sample, result.file.correlation, result.file.shrinkage);
    return;
  }
  for (Outlier& outlier : result.outliers) {
    outlier.subject = result.counted[outlier.subject];
  }
}

DepthModes ModesOf(const PopulationResult& result) {
  std::vector<DenseDepths> dense;
  for (const int at : result.counted) {
    dense.push_back(result.subjects[at].depths.dense);
  }
  return FindModes(dense, result.file.measure.dense);
}

std::vector<std::string> NotesOf(const PopulationPlan& plan, const PopulationResult& result) {
  std::vector<std::string> notes = plan.notes;
  const std::size_t dropped = result.sample.names.size() - result.joint.names.size();
  if (dropped > 0) {
    notes.push_back(fmt::format(
        "{} of {} numbers are in no correlation, as fewer than two subjects that differ have them",
        dropped, result.sample.names.size()));
  }
  if (result.joint.shrinkage > 0.5) {
    notes.push_back(fmt::format(
        "{:.0f} % of each correlation is the model's and not the subjects': they are too few",
        100 * result.joint.shrinkage));
  }
  const auto proposed = std::ranges::count_if(
      result.counted, [&](int at) { return result.subjects[at].depths.proposed; });
  if (proposed > 0) {
    notes.push_back(
        fmt::format("the landmarks of {} subjects were proposed by the program, and no "
                    "person has confirmed them",
                    proposed));
  }
  return notes;
}

}  // namespace

int PopulationResult::Count(const std::string& status) const {
  return static_cast<int>(std::ranges::count(subjects, status, &MeasuredSubject::status));
}

PopulationResult AnalysePopulation(const PopulationPlan& plan,
                                   std::vector<MeasuredSubject> subjects) {
  PopulationResult result;
  result.file = plan.file;
  result.subjects = std::move(subjects);
  for (std::size_t k = 0; k < result.subjects.size(); ++k) {
    if (result.subjects[k].status == "done") {
      result.counted.push_back(static_cast<int>(k));
    }
  }
  CheckEnough(result);
  result.sample = SampleOf(Counted(result), result.file.least_confidence);
  result.joint = FitPopulation(result.sample, result.file.correlation, result.file.shrinkage);
  LookForOutliers(result);
  result.table = TableOf(result.file, result.sample, result.joint);
  result.foresights = LeaveOneOut(result.file, Counted(result), result.sample);
  result.dense = ModesOf(result);
  result.notes = NotesOf(plan, result);
  return result;
}

std::string PopulationText(const PopulationResult& result) {
  std::string text = fmt::format(
      "{} subjects: {} measured, {} failed, {} missing; {} counted, {} sites; correlations {:.0f} "
      "% "
      "a model's\n{} outliers\n",
      result.subjects.size(), result.Count("done"), result.Count("failed"), result.Count("missing"),
      result.counted.size(), result.table.rows.size(), 100 * result.joint.shrinkage,
      result.outliers.size());
  for (const Foresight& way : result.foresights) {
    const DepthScores& s = way.scores;
    text += fmt::format(
        "a subject left out, {}: MAE {:.2f} mm, RMSE {:.2f} mm, CRPS {:.2f} mm, within 90 %: "
        "{:.1f} % of {}\n",
        way.name, s.mae_mm, s.rmse_mm, s.crps_mm, 100 * s.coverage_90, s.points);
  }
  for (std::size_t k = 0; k < result.dense.share.size(); ++k) {
    text += fmt::format("mode {}: {:.1f} % of the variance over the skull\n", k + 1,
                        100 * result.dense.share[k]);
  }
  return text;
}

}  // namespace semblance
