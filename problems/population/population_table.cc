// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/population_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/subject/site_names.h"
#include "problems/subject/sites.h"

namespace semblance {
namespace {

using Eigen::Index;

double Rounded(double value) { return std::round(value * 1e4) / 1e4; }

// Over the subjects that have the site, of a pair one side at least.
struct SiteMean {
  int n = 0;
  double mean_mm = 0;
};

SiteMean MeanOf(const JointSample& sample, const std::string& landmark) {
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

TissueRow RowOf(const Site& site, const JointSample& sample, const JointNormal& joint) {
  const SiteMean mean = MeanOf(sample, site.landmark);
  const auto own = joint.Find(site.code), twin = joint.Find(site.mirror);
  const auto at = own ? own : twin;
  TissueCell cell{.mean = Rounded(at ? joint.mean[*at] : mean.mean_mm),
                  .sd = at ? std::optional(Rounded(joint.sd[*at])) : std::nullopt,
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

TissueCorrelations CorrelationsOf(const JointSample& sample, const JointNormal& joint) {
  TissueCorrelations correlations{.subjects = static_cast<int>(sample.values.rows()),
                                  .shrinkage = Rounded(joint.shrinkage),
                                  .covariates = {},
                                  .names = joint.names,
                                  .rows = {}};
  for (Index i = 0; i < std::ssize(joint.names); ++i) {
    if (FindSite(joint.names[i]) == nullptr) {
      correlations.covariates.push_back(
          {joint.names[i], Rounded(joint.mean[i]), Rounded(joint.sd[i])});
    }
    std::vector<double>& row = correlations.rows.emplace_back();
    for (Index j = 0; j < i; ++j) {
      row.push_back(Rounded(joint.correlation(i, j)));
    }
  }
  return correlations;
}

}  // namespace

TissueTable TableOf(const PopulationFile& file, const JointSample& sample,
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
      .correlations = CorrelationsOf(sample, joint)};
  for (const std::string& name : sample.names) {
    const Site* const site = FindSite(name);
    const bool there = site == nullptr || std::ranges::find(table.rows, site->landmark,
                                                            &TissueRow::site) != table.rows.end();
    if (!there) {
      table.rows.push_back(RowOf(*site, sample, joint));
    }
  }
  return table;
}

}  // namespace semblance
