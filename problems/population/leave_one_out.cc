// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/leave_one_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "problems/subject/sites.h"

namespace semblance::problems {
namespace {

using Eigen::Index;

struct Forecast {
  double mean_mm = kNaN, sd_mm = kNaN;
};
using Forecasts = std::map<std::string, Forecast>;  // by site

bool IsKnownSite(const PopulationFile& file, const std::string& site) {
  return std::ranges::any_of(
      file.known, [&](const std::string& code) { return WithoutSide(code) == WithoutSide(site); });
}

JointSample Without(const JointSample& sample, Index subject) {
  JointSample rest{sample.names, Eigen::MatrixXd(sample.values.rows() - 1, sample.values.cols())};
  rest.values.topRows(subject) = sample.values.topRows(subject);
  rest.values.bottomRows(rest.values.rows() - subject) =
      sample.values.bottomRows(rest.values.rows() - subject);
  return rest;
}

// The known values of the subject's row: covariates if `person`, depths at the known sites if
// `depths`.
std::vector<KnownValue> KnownValues(const PopulationFile& file, const JointSample& sample,
                                    Index subject, const JointNormal& joint, bool person,
                                    bool depths) {
  std::vector<KnownValue> known;
  for (Index j = 0; j < std::ssize(sample.names); ++j) {
    const std::string& name = sample.names[j];
    const bool wanted = IsSite(name) ? depths && IsKnownSite(file, name) : person;
    if (wanted && std::isfinite(sample.values(subject, j)) && joint.Find(name)) {
      known.push_back({name, sample.values(subject, j)});
    }
  }
  return known;
}

Forecasts Predict(const JointNormal& joint, const std::vector<KnownValue>& known) {
  const ConditionalNormal expected = Condition(joint, known);
  Forecasts forecasts;
  for (std::size_t k = 0; k < joint.names.size(); ++k) {
    if (IsSite(joint.names[k])) {
      const auto at = static_cast<Index>(k);
      forecasts[joint.names[k]] = {expected.mean[at], expected.sd[at]};
    }
  }
  return forecasts;
}

Forecasts Predict(const TissueTable& table, const PopulationSubject& person,
                  const JointSample& sample) {
  Forecasts forecasts;
  for (const std::string& name : sample.names) {
    const auto depth = FindDepth(table, person.sex.value_or(Sex::kMale),
                                 person.build.value_or(Build::kNormal), name);
    if (IsSite(name) && depth) {
      forecasts[name] = {depth->mean_mm, depth->sd_mm.value_or(kNaN)};
    }
  }
  return forecasts;
}

// True if the table has columns of sex and build, and one of them is not known of the person.
bool NeedsAssumption(const TissueTable& table, const PopulationSubject& person) {
  const bool is_pooled =
      !table.rows.empty() && table.rows.front().values.contains("adult");  // tissue_table.h
  return !is_pooled && !(person.sex && person.build);
}

struct NamedTable {
  std::string name;
  TissueTable table;
};

// The id, followed by a number if it is already the name of another method.
std::string UniqueName(const std::string& id, const std::vector<NamedTable>& before) {
  constexpr std::array kOwn = {"mean", "person", "known", "person_known"};
  std::string name = id;
  for (int number = 2; std::ranges::find(kOwn, name) != kOwn.end() ||
                       std::ranges::find(before, name, &NamedTable::name) != before.end();
       ++number) {
    name = fmt::format("{} ({})", id, number);
  }
  return name;
}

class Predictor {
 public:
  Predictor(const PopulationFile& file, const std::vector<CountedSubject>& subjects,
            const JointSample& sample)
      : file_(file), subjects_(subjects), sample_(sample) {
    for (const std::filesystem::path& path : file.tables) {
      TissueTable table = ReadTissueTable(path);
      const std::string name = UniqueName(table.id, tables_);
      tables_.push_back({name, std::move(table)});
    }
    // A method without a number that varies would repeat the mean.
    for (const std::string& name : Varying(sample).names) {
      has_person_ = has_person_ || !IsSite(name);
      has_known_ = has_known_ || (IsSite(name) && IsKnownSite(file, name));
    }
  }

  // The forecasts of all methods, by name, for one subject from the others.
  std::vector<std::pair<std::string, Forecasts>> PredictSubject(Index subject) const {
    const JointNormal joint =
        FitPopulation(Without(sample_, subject), file_.correlation, file_.shrinkage);
    std::vector<std::pair<std::string, Forecasts>> ways;
    const auto add = [&](const char* name, bool person, bool depths) {
      ways.emplace_back(
          name, Predict(joint, KnownValues(file_, sample_, subject, joint, person, depths)));
    };
    add("mean", false, false);
    if (has_person_) {
      add("person", true, false);
    }
    if (has_known_) {
      add("known", false, true);
    }
    if (has_person_ && has_known_) {
      add("person_known", true, true);
    }
    for (const auto& [name, table] : tables_) {
      ways.emplace_back(name, Predict(table, subjects_[subject].person, sample_));
    }
    return ways;
  }

  // The number of subjects whose sex or build the method has to assume, if it is a table.
  int CountAssumed(const std::string& way) const {
    const auto at = std::ranges::find(tables_, way, &NamedTable::name);
    return at == tables_.end()
               ? 0
               : static_cast<int>(std::ranges::count_if(subjects_, [&](const auto& subject) {
                   return NeedsAssumption(at->table, subject.person);
                 }));
  }

  // True if all methods predict the site and the subject has a depth there.
  bool Counts(Index subject, Index column,
              const std::vector<std::pair<std::string, Forecasts>>& ways) const {
    const std::string& site = sample_.names[column];
    return IsSite(site) && !IsKnownSite(file_, site) &&
           std::isfinite(sample_.values(subject, column)) &&
           std::ranges::all_of(ways, [&](const auto& way) { return way.second.contains(site); });
  }

 private:
  const PopulationFile& file_;
  const std::vector<CountedSubject>& subjects_;
  const JointSample& sample_;
  std::vector<NamedTable> tables_;
  bool has_person_ = false, has_known_ = false;
};

void Score(int subjects, PredictedSites& way) {
  std::vector<double> errors, sds, sums(subjects, 0), counts(subjects, 0);
  for (const PredictedDepth& depth : way.depths) {
    errors.push_back(depth.predicted_mm - depth.depth_mm);
    sds.push_back(depth.sd_mm);
    sums[depth.subject] += std::abs(errors.back());
    counts[depth.subject] += 1;
  }
  way.scores = ScoreDepths(errors, sds);
  for (int subject = 0; subject < subjects; ++subject) {
    way.mae_mm.push_back(counts[subject] > 0 ? sums[subject] / counts[subject] : kNaN);
  }
}

void CompareWithMean(std::vector<PredictedSites>& ways) {
  for (PredictedSites& way : ways) {
    std::vector<double> differences;
    for (std::size_t subject = 0; subject < way.mae_mm.size(); ++subject) {
      const double difference = way.mae_mm[subject] - ways.front().mae_mm[subject];
      if (std::isfinite(difference)) {
        differences.push_back(difference);
      }
    }
    way.against_mean_mm = Summarize(differences);
  }
}

}  // namespace

std::vector<PredictedSites> LeaveOneOut(const PopulationFile& file,
                                        const std::vector<CountedSubject>& subjects,
                                        const JointSample& sample) {
  constexpr Index kMinSubjects = 3;
  std::vector<PredictedSites> result;
  if (sample.values.rows() < kMinSubjects) {
    return result;
  }
  const Predictor predictor(file, subjects, sample);
  for (Index subject = 0; subject < sample.values.rows(); ++subject) {
    const auto ways = predictor.PredictSubject(subject);
    result.resize(ways.size());
    for (Index j = 0; j < sample.values.cols(); ++j) {
      if (!predictor.Counts(subject, j, ways)) {
        continue;
      }
      for (std::size_t w = 0; w < ways.size(); ++w) {
        const Forecast& forecast = ways[w].second.at(sample.names[j]);
        result[w].depths.push_back({static_cast<int>(subject), sample.names[j],
                                    sample.values(subject, j), forecast.mean_mm, forecast.sd_mm});
      }
    }
    for (std::size_t w = 0; w < ways.size(); ++w) {
      result[w].name = ways[w].first;
    }
  }
  for (PredictedSites& way : result) {
    way.assumed = predictor.CountAssumed(way.name);
    Score(static_cast<int>(sample.values.rows()), way);
  }
  CompareWithMean(result);
  return result;
}

}  // namespace semblance::problems
