// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_sample.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "problems/conditional/site_correlation.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

using Eigen::Index;

// The columns: sites that any subject was measured at, then covariates.
std::vector<std::string> NamesOf(const std::vector<CountedSubject>& subjects) {
  std::set<std::string> measured, known;
  for (const CountedSubject& subject : subjects) {
    for (const SiteDepth& site : subject.depths.sites) {
      measured.insert(site.site);
    }
    for (const auto& [name, value] : CovariatesOf(subject)) {
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

// Left and right of a pair as one.
void EvenOut(Index left, Index right, JointNormal& joint) {
  joint.mean[left] = joint.mean[right] = (joint.mean[left] + joint.mean[right]) / 2;
  joint.sd[left] = joint.sd[right] =
      std::sqrt((joint.sd[left] * joint.sd[left] + joint.sd[right] * joint.sd[right]) / 2);
  joint.sample[left] = joint.sample[right] = std::max(joint.sample[left], joint.sample[right]);
}

}  // namespace

std::map<std::string, double> CovariatesOf(const CountedSubject& subject) {
  constexpr double kAverage = 25, kPerShare = 45, kError = 2;
  const PopulationSubject& person = subject.person;
  std::map<std::string, double> known;
  if (person.sex) {
    known["sex"] = CovariateOf(*person.sex);
  }
  if (person.build) {
    known["build"] = CovariateOf(*person.build);
  }
  if (person.age_years) {
    known["age_years"] = *person.age_years;
  }
  if (person.bmi) {
    known["bmi"] = *person.bmi;
  } else if (const auto* phantom = std::get_if<PhantomOptions>(&person.subject)) {
    Random random(phantom->random_seed);
    known["bmi"] =
        kAverage + kPerShare * (subject.depths.thickness - 1) + kError * random.BoundedNormal();
  }
  return known;
}

JointSample SampleOf(const std::vector<CountedSubject>& subjects, double least_confidence) {
  JointSample sample{.names = NamesOf(subjects), .values = {}};
  sample.values = Eigen::MatrixXd::Constant(std::ssize(subjects), std::ssize(sample.names), kNaN);
  const auto put = [&](Index row, const std::string& name, double value) {
    const auto at = std::ranges::find(sample.names, name);
    sample.values(row, at - sample.names.begin()) = value;
  };
  for (Index row = 0; row < std::ssize(subjects); ++row) {
    for (const SiteDepth& site : subjects[row].depths.sites) {
      put(row, site.site, site.confidence >= least_confidence ? site.depth_mm : kNaN);
    }
    for (const auto& [name, value] : CovariatesOf(subjects[row])) {
      put(row, name, value);
    }
  }
  return sample;
}

bool IsSite(const std::string& name) { return IsStandardSite(name) || IsFurtherSite(name); }

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
  for (const Site& site : StandardSites()) {
    const auto left = joint.Find(site.code), right = joint.Find(site.mirror);
    if (site.side == Side::kLeft && left && right) {
      EvenOut(*left, *right, joint);
    }
  }
  for (const Site& site : FurtherSites()) {
    const auto left = joint.Find(site.code), right = joint.Find(site.mirror);
    if (site.side == Side::kLeft && left && right) {
      EvenOut(*left, *right, joint);
    }
  }
  return joint;
}

}  // namespace semblance
