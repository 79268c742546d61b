// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_result.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

constexpr int kFewestSubjects = 3;

int CountOf(const std::vector<MeasuredSubject>& subjects, const std::string& status) {
  return static_cast<int>(std::ranges::count(subjects, status, &MeasuredSubject::status));
}

std::vector<CountedSubject> Counted(const PopulationResult& result) {
  std::vector<CountedSubject> counted;
  for (const int at : result.counted) {
    counted.push_back({result.subjects[at].person, result.subjects[at].depths});
  }
  return counted;
}

// Nothing is looked for where too few have a depth, which is not the same as finding nothing.
void NoteWhereNoOutliers(PopulationResult& result) {
  if (!result.LooksForOutliers()) {
    result.notes.push_back(
        fmt::format("fewer than {} subjects: outliers are not looked for", kFewestForOutliers));
    return;
  }
  int sites = 0, unseen = 0;
  for (Eigen::Index j = 0; j < result.sample.values.cols(); ++j) {
    const bool is_site = IsSite(result.sample.names[j]);
    sites += is_site ? 1 : 0;
    unseen += is_site && result.sample.values.col(j).array().isFinite().count() < kFewestForOutliers
                  ? 1
                  : 0;
  }
  if (unseen > 0) {
    result.notes.push_back(fmt::format(
        "outliers are not looked for at {} of {} sites, which fewer than {} subjects have", unseen,
        sites, kFewestForOutliers));
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
    if (static_cast<int>(counted.size()) < kFewestSubjects) {
      throw InputError(fmt::format(
          "{}: without the outliers {} subjects are left; a population needs at least {}",
          result.file.title, counted.size(), kFewestSubjects));
    }
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

std::vector<std::string> NotesOf(const PopulationResult& result) {
  std::vector<std::string> notes = result.notes;
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
  for (const Foresight& way : result.foresights) {
    if (way.assumed > 0) {
      notes.push_back(fmt::format(
          "table {}: the sex or build of {} of {} subjects is not known; they are compared with "
          "its males where the sex is not, and with its normal build where the build is not",
          way.name, way.assumed, result.counted.size()));
    }
  }
  return notes;
}

std::string TextOf(const Foresight& way) {
  const DepthScores& s = way.scores;
  if (s.points == 0) {
    return fmt::format("a subject left out, {}: no depth to compare\n", way.name);
  }
  return fmt::format("a subject left out, {}: MAE {:.2f} mm, RMSE {:.2f} mm, {}\n", way.name,
                     s.mae_mm, s.rmse_mm,
                     s.stated > 0 ? fmt::format("CRPS {:.2f} mm, within 90 %: {:.1f} % of {}",
                                                s.crps_mm, 100 * s.coverage_90, s.stated)
                                  : fmt::format("no sd stated, {} depths", s.points));
}

}  // namespace

int PopulationResult::Count(const std::string& status) const { return CountOf(subjects, status); }

bool PopulationResult::LooksForOutliers() const { return Count("done") >= kFewestForOutliers; }

std::string WhyNoTable(const PopulationPlan& plan, const std::vector<MeasuredSubject>& subjects) {
  const int done = CountOf(subjects, "done");
  return done >= kFewestSubjects
             ? ""
             : fmt::format(
                   "{}: {} subjects are measured ({} failed, {} missing); a population "
                   "needs at least {}",
                   plan.file.title, done, CountOf(subjects, "failed"), CountOf(subjects, "missing"),
                   kFewestSubjects);
}

PopulationResult AnalysePopulation(const PopulationPlan& plan,
                                   std::vector<MeasuredSubject> subjects) {
  if (const std::string why = WhyNoTable(plan, subjects); !why.empty()) {
    throw InputError(why);
  }
  PopulationResult result;
  result.file = plan.file;
  result.notes = plan.notes;
  result.subjects = std::move(subjects);
  for (std::size_t k = 0; k < result.subjects.size(); ++k) {
    if (result.subjects[k].status == "done") {
      result.counted.push_back(static_cast<int>(k));
    }
  }
  result.sample = SampleOf(Counted(result), result.file.least_confidence);
  result.joint = FitPopulation(result.sample, result.file.correlation, result.file.shrinkage);
  NoteWhereNoOutliers(result);
  LookForOutliers(result);
  result.table = TableOf(result.file, result.sample, result.joint);
  result.foresights = LeaveOneOut(result.file, Counted(result), result.sample);
  result.dense = ModesOf(result);
  result.notes = NotesOf(result);
  return result;
}

std::string PopulationText(const PopulationResult& result) {
  std::string text = fmt::format(
      "{} subjects: {} measured, {} failed, {} missing; {} counted, {} sites; correlations {:.0f} "
      "% "
      "a model's\n{}\n",
      result.subjects.size(), result.Count("done"), result.Count("failed"), result.Count("missing"),
      result.counted.size(), result.table.rows.size(), 100 * result.joint.shrinkage,
      result.LooksForOutliers() ? fmt::format("{} outliers", result.outliers.size())
                                : "outliers not looked for");
  for (const Foresight& way : result.foresights) {
    text += TextOf(way);
  }
  for (std::size_t k = 0; k < result.dense.share.size(); ++k) {
    text += fmt::format("mode {}: {:.1f} % of the variance over the skull\n", k + 1,
                        100 * result.dense.share[k]);
  }
  return text;
}

}  // namespace semblance
