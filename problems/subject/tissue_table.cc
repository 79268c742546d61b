// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/tissue_table.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "problems/config/config.h"
#include "problems/subject/sites.h"

namespace semblance::problems {
namespace {

constexpr char kPooled[] = "adult";

std::vector<std::string> SixStrata() {
  std::vector<std::string> strata;
  for (const Build build : {Build::kEmaciated, Build::kNormal, Build::kObese}) {
    for (const Sex sex : {Sex::kMale, Sex::kFemale}) {
      strata.push_back(StratumName(sex, build));
    }
  }
  return strata;
}

std::vector<std::string> ListStrata(const TissueRow& row) {
  std::vector<std::string> strata;
  for (const auto& [stratum, cell] : row.values) {
    strata.push_back(stratum);
  }
  return strata;
}

bool IsPooled(const TissueTable& table) {
  return !table.rows.empty() && table.rows.front().values.contains(kPooled);
}

std::string FindStratum(const TissueTable& table, Sex sex, Build build) {
  return IsPooled(table) ? kPooled : StratumName(sex, build);
}

const TissueCell* FindCell(const TissueTable& table, const std::string& stratum,
                           const std::string& site) {
  const std::string code = WithoutSide(site);
  for (const TissueRow& row : table.rows) {
    const auto it = row.values.find(stratum);
    if (row.site == code && it != row.values.end()) {
      return &it->second;
    }
  }
  return nullptr;
}

bool HasDepth(const TissueCell* cell) { return cell && cell->mean; }

std::string WhyNoDepth(const TissueCell* cell) {
  if (!cell) {
    return "not in the table";
  }
  return cell->note.empty() ? "missing" : fmt::format("missing: {}", cell->note);
}

// The row's known depths by build, lightest build first.
std::vector<double> MeansByBuild(const TissueRow& row, Sex sex) {
  std::vector<double> means;
  for (const Build build : {Build::kEmaciated, Build::kNormal, Build::kObese}) {
    const auto it = row.values.find(StratumName(sex, build));
    if (it != row.values.end() && it->second.mean) {
      means.push_back(*it->second.mean);
    }
  }
  return means;
}

bool GrowsWithBuild(const TissueRow& row, Sex sex) {
  const std::vector<double> means = MeansByBuild(row, sex);
  return std::is_sorted(means.begin(), means.end());
}

// Empty if the row's depths grow with the build in both sexes; otherwise the depths of each sex in
// which they do not.
std::string DescribeDisorder(const TissueRow& row) {
  std::string text;
  for (const Sex sex : {Sex::kMale, Sex::kFemale}) {
    if (!GrowsWithBuild(row, sex)) {
      text += fmt::format("{} {} {:.2f} mm", text.empty() ? "" : ",",
                          sex == Sex::kMale ? "male" : "female",
                          fmt::join(MeansByBuild(row, sex), " "));
    }
  }
  return text;
}

bool IsCovariate(const TissueCorrelations& o, const std::string& name) {
  return std::ranges::find(o.covariates, name, &TissueCovariate::name) != o.covariates.end();
}

// The fault of the rows; empty if they are a lower triangle of numbers between -1 and 1.
std::string RowsFault(const TissueCorrelations& o) {
  if (o.rows.size() != o.names.size()) {
    return fmt::format("{} rows for {} names; write one per name", o.rows.size(), o.names.size());
  }
  for (std::size_t k = 0; k < o.rows.size(); ++k) {
    if (o.rows[k].size() != k) {
      return fmt::format("the row of '{}' has {} numbers; it needs {}, one for each name before it",
                         o.names[k], o.rows[k].size(), k);
    }
    if (!std::ranges::all_of(o.rows[k], [](double r) { return std::abs(r) < 1; })) {
      return fmt::format("the row of '{}' has a number that is not between -1 and 1", o.names[k]);
    }
  }
  return "";
}

bool IsPositiveDefinite(const TissueCorrelations& o) {
  const auto size = static_cast<Eigen::Index>(o.names.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      matrix(i, j) = matrix(j, i) = o.rows[i][j];
    }
  }
  return matrix.llt().info() == Eigen::Success;
}

// The fault of a site among the correlations; empty if every stratum of its row has an sd.
std::string SpreadFault(const TissueTable& table, const std::string& site) {
  const auto row = std::ranges::find(table.rows, WithoutSide(site), &TissueRow::site);
  if (row == table.rows.end()) {
    return fmt::format("'{}' is not in the table", site);
  }
  for (const auto& [stratum, cell] : row->values) {
    if (!cell.sd || *cell.sd <= 0) {
      return fmt::format("'{}' has no sd above 0 for {}; a correlation needs one", site, stratum);
    }
  }
  return "";
}

}  // namespace

template <class Report>
void CheckValue(Report& report, const TissueCorrelations& o) {
  std::set<std::string> seen;
  for (const std::string& name : o.names) {
    if (!seen.insert(name).second) {
      report("names", fmt::format("'{}' appears twice; keep one", name));
    }
    if (!IsCovariate(o, name) && !SiteFault(name).empty()) {
      report("names", fmt::format("{}; or is it a covariate that is missing from `covariates`?",
                                  SiteFault(name)));
    }
  }
  for (const TissueCovariate& covariate : o.covariates) {
    const std::vector<std::string> known = CovariateNames();
    if (std::ranges::find(known, covariate.name) == known.end() || !std::isfinite(covariate.mean) ||
        !std::isfinite(covariate.sd)) {
      report("covariates", fmt::format("'{}': must be one of {}, with mean and sd", covariate.name,
                                       fmt::join(known, ", ")));
    }
  }
  if (const std::string complaint = RowsFault(o); !complaint.empty()) {
    report("rows", complaint);
  } else if (!IsPositiveDefinite(o)) {
    report("rows", "the matrix is not positive definite, so no depths can have these correlations");
  }
}

template <class Report>
void CheckValue(Report& report, const TissueCell& cell) {
  if ((cell.flag == CellFlag::kMissing) == cell.mean.has_value()) {
    report("mean", cell.mean ? "a missing cell has no mean; write null, or another flag"
                             : "a cell without mean needs `flag: missing`");
  }
  if (cell.sd && !cell.mean) {
    report("sd", "a cell without mean has no sd; leave it out");
  }
}

template <class Report>
void CheckValue(Report& report, const TissueRow& row) {
  std::vector<std::string> six = SixStrata();
  std::sort(six.begin(), six.end());
  const std::vector<std::string> strata = ListStrata(row);
  if (strata != six && strata != std::vector<std::string>{kPooled}) {
    report("values", fmt::format("the strata must be all of {}, or only {}",
                                 fmt::join(SixStrata(), ", "), kPooled));
  }
  if (row.site.empty() || WithoutSide(row.site) != row.site) {
    report("site", fmt::format("'{}' is not a code without side; list a pair once", row.site));
  }
}

template <class Report>
void CheckValue(Report& report, const TissueTable& table) {
  if (table.units != "mm") {
    report("units",
           fmt::format("must be mm, not '{}'; convert the depths to millimetres", table.units));
  }
  if (table.id.empty()) {
    report("id", "give the table a short name; messages use it");
  }
  if (table.rows.empty()) {
    report("rows", "the list is empty; list at least one site");
  }
  std::set<std::string> sites;
  for (const TissueRow& row : table.rows) {
    if (!sites.insert(row.site).second) {
      report("rows", fmt::format("site '{}' appears twice; keep one", row.site));
    }
    if (ListStrata(row) != ListStrata(table.rows.front())) {
      report("rows",
             fmt::format("site '{}' has other strata than the first row; give all rows the same "
                         "strata",
                         row.site));
    }
  }
  for (const std::string& name :
       table.correlations ? table.correlations->names : std::vector<std::string>()) {
    const std::string complaint =
        IsCovariate(*table.correlations, name) ? std::string() : SpreadFault(table, name);
    if (!complaint.empty()) {
      report("correlations", complaint);
    }
  }
}

std::vector<std::string> CovariateNames() { return {"sex", "build", "age_years", "bmi"}; }

double CovariateValue(Sex sex) { return sex == Sex::kMale ? 1 : 0; }
double CovariateValue(Build build) { return static_cast<int>(build) - 1; }

std::string StratumName(Sex sex, Build build) {
  return fmt::format("{}_{}", EnumNames(build)[static_cast<std::size_t>(build)],
                     EnumNames(sex)[static_cast<std::size_t>(sex)]);
}

TissueTable ReadTissueTable(const std::filesystem::path& path) {
  return ReadConfig<TissueTable>(path);
}

std::optional<TissueDepth> FindDepth(const TissueTable& table, Sex sex, Build build,
                                     const std::string& site) {
  const TissueCell* const cell = FindCell(table, FindStratum(table, sex, build), site);
  if (!HasDepth(cell)) {
    return std::nullopt;
  }
  return TissueDepth{*cell->mean, cell->sd, cell->flag, cell->note, cell->n};
}

std::string WhyNoDepth(const TissueTable& table, Sex sex, Build build, const std::string& site) {
  return WhyNoDepth(FindCell(table, FindStratum(table, sex, build), site));
}

std::vector<std::string> UnorderedLandmarks(const TissueTable& table, Sex sex,
                                            std::span<const std::string> sites) {
  std::set<std::string> used;
  std::ranges::transform(sites, std::inserter(used, used.end()), WithoutSide);
  std::vector<std::string> unordered;
  for (const TissueRow& row : table.rows) {
    if (used.contains(row.site) && !GrowsWithBuild(row, sex)) {
      unordered.push_back(row.site);
    }
  }
  return unordered;
}

std::vector<std::string> TableWarnings(const TissueTable& table) {
  std::vector<std::string> warnings;
  for (const TissueRow& row : table.rows) {
    if (const std::string disorder = DescribeDisorder(row); !disorder.empty()) {
      warnings.push_back(
          fmt::format("tissue table '{}', {}: depth does not grow from emaciated to obese:{}",
                      table.id, DescribeSite(row.site), disorder));
    }
    for (const auto& [stratum, cell] : row.values) {
      if (cell.flag == CellFlag::kSuspect) {
        warnings.push_back(fmt::format("tissue table '{}', {}, {}: {:.2f} mm is suspect: {}",
                                       table.id, DescribeSite(row.site), stratum,
                                       cell.mean.value_or(0), cell.note));
      }
    }
  }
  return warnings;
}

namespace {

// The means and deviations of configs/tables/t_table_2023.yaml, of the standard sites.
const std::map<std::string, PublishedDepth, std::less<>>& TTable() {
  static const std::map<std::string, PublishedDepth, std::less<>> table = {
      {"g", {5.5, 1}},   {"n", {6, 1.5}},   {"rhi", {3, 1}},    {"mp", {11.5, 2.5}},
      {"pr", {12, 3}},   {"id", {13.5, 3}}, {"sm", {11, 2}},    {"pg", {11, 2.5}},
      {"me", {7, 2.5}},  {"mso", {7, 2}},   {"mio", {6.5, 3}},  {"zy", {7.5, 3}},
      {"go", {12.5, 6}}, {"sM2", {26, 7}},  {"iM2", {22, 6.5}}, {"mr", {19.5, 5}}};
  return table;
}

}  // namespace

std::optional<PublishedDepth> FindPublishedDepth(std::string_view site) {
  const auto found = TTable().find(WithoutSide(site));
  return found != TTable().end() ? std::optional(found->second) : std::nullopt;
}

}  // namespace semblance::problems
