// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/subject/condition_depths.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

using Eigen::Index;

// The names of the columns: sites at which any subject was measured, then covariates.
std::vector<std::string> ColumnNames(const std::vector<CountedSubject>& subjects) {
  std::set<std::string> measured, known;
  for (const CountedSubject& subject : subjects) {
    for (const SiteDepth& site : subject.depths.sites) {
      measured.insert(site.site);
    }
    for (const auto& [name, value] : KnownCovariates(subject)) {
      known.insert(name);
    }
  }
  std::vector<std::string> names;
  for (const Site& site : AllSites()) {
    if (measured.contains(site.code)) {
      names.push_back(site.code);
    }
  }
  for (const std::string& name : CovariateNames()) {
    if (known.contains(name)) {
      names.push_back(name);
    }
  }
  return names;
}

bool Varies(const Eigen::VectorXd& column) {
  std::set<double> different;
  int count = 0;
  for (const double x : column) {
    if (std::isfinite(x)) {
      different.insert(x);
      ++count;
    }
  }
  return count >= 2 && different.size() >= 2;
}

// Gives both sides of a pair the same mean, sd and sample size.
void AverageSides(Index left, Index right, JointNormal& joint) {
  joint.mean[left] = joint.mean[right] = (joint.mean[left] + joint.mean[right]) / 2;
  joint.sd[left] = joint.sd[right] =
      std::sqrt((joint.sd[left] * joint.sd[left] + joint.sd[right] * joint.sd[right]) / 2);
  joint.sample[left] = joint.sample[right] = std::max(joint.sample[left], joint.sample[right]);
}

using Eigen::Index;

double RoundedToMicrometres(double value) { return std::round(value * 1e4) / 1e4; }

// The mean depth of a landmark, over both sides of a pair.
struct SiteMean {
  int n = 0;  // subjects with a depth at the site, or at one side of the pair
  double mean_mm = 0;
};

SiteMean ComputeMean(const JointSample& sample, const std::string& landmark) {
  SiteMean mean;
  double sum = 0;
  int values = 0;
  for (const auto row : sample.values.rowwise()) {
    bool any = false;
    for (Index j = 0; j < row.size(); ++j) {
      if (WithoutSide(sample.names[j]) == landmark && std::isfinite(row[j])) {
        sum += row[j];
        ++values;
        any = true;
      }
    }
    mean.n += any ? 1 : 0;
  }
  mean.mean_mm = sum / values;
  return mean;
}

TissueRow MakeRow(const Site& site, const JointSample& sample, const JointNormal& joint) {
  const SiteMean mean = ComputeMean(sample, site.landmark);
  const auto own = joint.Find(site.code), twin = joint.Find(site.mirror);
  const auto at = own ? own : twin;
  TissueCell cell{.mean = RoundedToMicrometres(at ? joint.mean[*at] : mean.mean_mm),
                  .sd = at ? std::optional(RoundedToMicrometres(joint.sd[*at])) : std::nullopt,
                  .n = mean.n,
                  .flag = CellFlag::kOk,
                  .note = at ? "" : "too few subjects for a standard deviation"};
  if (mean.n == 0) {
    cell = {.mean = {}, .sd = {}, .n = {}, .flag = CellFlag::kMissing, .note = "not measured"};
  }
  return {.site = site.landmark,
          .number = site.number > 0 ? std::optional(site.number) : std::nullopt,
          .name = std::string(site.name),
          .values = {{"adult", cell}}};
}

TissueCorrelations MakeCorrelations(const JointSample& sample, const JointNormal& joint) {
  TissueCorrelations correlations{.subjects = static_cast<int>(sample.values.rows()),
                                  .shrinkage = RoundedToMicrometres(joint.shrinkage),
                                  .covariates = {},
                                  .names = joint.names,
                                  .rows = {}};
  for (Index i = 0; i < std::ssize(joint.names); ++i) {
    if (FindSite(joint.names[i]) == nullptr) {
      correlations.covariates.push_back(
          {joint.names[i], RoundedToMicrometres(joint.mean[i]), RoundedToMicrometres(joint.sd[i])});
    }
    std::vector<double>& row = correlations.rows.emplace_back();
    for (Index j = 0; j < i; ++j) {
      row.push_back(RoundedToMicrometres(joint.correlation(i, j)));
    }
  }
  return correlations;
}

}  // namespace

std::map<std::string, double> KnownCovariates(const CountedSubject& subject) {
  constexpr double kAverageBmi = 25, kBmiPerThickness = 45, kBmiError = 2;
  const PopulationSubject& person = subject.person;
  std::map<std::string, double> known;
  if (person.sex) {
    known["sex"] = CovariateValue(*person.sex);
  }
  if (person.build) {
    known["build"] = CovariateValue(*person.build);
  }
  if (person.age_years) {
    known["age_years"] = *person.age_years;
  }
  if (person.bmi) {
    known["bmi"] = *person.bmi;
  } else if (const auto* phantom = std::get_if<PhantomOptions>(&person.subject)) {
    Random random(phantom->random_seed);
    known["bmi"] = kAverageBmi + kBmiPerThickness * (subject.depths.thickness - 1) +
                   kBmiError * random.BoundedNormal();
  }
  return known;
}

JointSample MakeSample(const std::vector<CountedSubject>& subjects, double least_confidence) {
  JointSample sample{.names = ColumnNames(subjects), .values = {}};
  sample.values = Eigen::MatrixXd::Constant(std::ssize(subjects), std::ssize(sample.names), kNaN);
  const auto put = [&](Index row, const std::string& name, double value) {
    const auto at = std::ranges::find(sample.names, name);
    sample.values(row, at - sample.names.begin()) = value;
  };
  for (Index row = 0; row < std::ssize(subjects); ++row) {
    for (const SiteDepth& site : subjects[row].depths.sites) {
      put(row, site.site, site.confidence >= least_confidence ? site.depth_mm : kNaN);
    }
    for (const auto& [name, value] : KnownCovariates(subjects[row])) {
      put(row, name, value);
    }
  }
  return sample;
}

JointSample Varying(const JointSample& sample) {
  JointSample varying;
  std::vector<Index> columns;
  for (Index j = 0; j < sample.values.cols(); ++j) {
    if (Varies(sample.values.col(j))) {
      columns.push_back(j);
      varying.names.push_back(sample.names[j]);
    }
  }
  varying.values = sample.values(Eigen::all, columns);
  return varying;
}

JointNormal FitPopulation(const JointSample& sample, const SiteCorrelation& model,
                          std::optional<double> shrinkage) {
  const JointSample varying = Varying(sample);
  JointNormal joint = FitJointNormal(varying, ModelledCorrelation(model, varying.names), shrinkage);
  for (const Site& site : AllSites()) {
    const auto left = joint.Find(site.code), right = joint.Find(site.mirror);
    if (site.side == Side::kLeft && left && right) {
      AverageSides(*left, *right, joint);
    }
  }
  return joint;
}

TissueTable MakeTissueTable(const PopulationFile& file, const JointSample& sample,
                            const JointNormal& joint) {
  TissueTable table{
      .id = file.id,
      .title = file.title,
      .citation = fmt::format("semblance population, {} subjects", sample.values.rows()),
      .population_label = file.label,
      .units = "mm",
      .measurement = {.method = DepthMethod::kUnspecified,
                      .convention = file.measure.convention,
                      .posture = DepthPosture::kUnspecified},
      .rows = {},
      .correlations = MakeCorrelations(sample, joint)};
  for (const std::string& name : sample.names) {
    const Site* const site = FindSite(name);
    const bool there = site == nullptr || std::ranges::find(table.rows, site->landmark,
                                                            &TissueRow::site) != table.rows.end();
    if (!there) {
      table.rows.push_back(MakeRow(*site, sample, joint));
    }
  }
  return table;
}

}  // namespace semblance::problems
