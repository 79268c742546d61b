// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/conditional/condition_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "problems/conditional/site_correlation.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Notes = std::vector<std::string>;

constexpr double kThinnest_mm = 0.5;
constexpr double kFarthest_sds = 4;  // from the mean: beyond these no subject says how it goes on

std::map<std::string, double> KnownCovariates(const TissueGiven& given) {
  std::map<std::string, double> known;
  const auto add = [&](const char* name, const std::optional<double>& value) {
    if (value) {
      known[name] = *value;
    }
  };
  add("sex", given.sex ? std::optional(CovariateOf(*given.sex)) : std::nullopt);
  add("build", given.build ? std::optional(CovariateOf(*given.build)) : std::nullopt);
  add("age_years", given.age_years);
  add("bmi", given.bmi);
  return known;
}

// The tables' means in place of those of the table of spreads.
void TakeMeans(const TissueOptions& options, JointNormal& joint) {
  std::vector<TissueTable> tables;
  for (const std::filesystem::path& path : TablesOf(options)) {
    tables.push_back(ReadTissueTable(path));
  }
  for (std::size_t k = 0; k < joint.names.size(); ++k) {
    for (const TissueTable& table : tables) {
      if (const auto depth = FindDepth(table, options.sex, options.build, joint.names[k])) {
        joint.mean[static_cast<Eigen::Index>(k)] = depth->mean_mm;
        break;
      }
    }
  }
}

std::vector<std::string> AllCodes() {
  std::vector<std::string> sites;
  for (const Site& site : AllSites()) {
    sites.push_back(site.code);
  }
  return sites;
}

JointNormal JointOf(const TissueOptions& options) {
  const TissueGiven& given = options.given;
  const std::filesystem::path& path = given.spread.empty() ? options.table : given.spread;
  const TissueTable table = ReadTissueTable(path);
  JointNormal joint =
      JointOfTable(table, options.sex, options.build, given.correlation, AllCodes());
  if (joint.names.empty()) {
    throw InputError(fmt::format(
        "tissue.given: table '{}' states no standard deviation, so nothing tells how depths vary; "
        "name one that does under given.spread, such as configs/tables/t_table_2023.yaml",
        table.id));
  }
  if (!given.spread.empty()) {
    TakeMeans(options, joint);
  }
  return joint;
}

// What is known and tells something. Covariates must; sites may be strange to the table.
std::vector<KnownValue> Telling(const TissueGiven& given, const JointNormal& joint,
                                const std::map<std::string, double>& depths, Notes& notes) {
  std::vector<KnownValue> known;
  std::vector<std::string> silent;
  for (const auto& [site, depth_mm] : depths) {
    joint.Find(site) ? known.push_back({site, depth_mm, given.error_mm}) : silent.push_back(site);
  }
  for (const auto& [name, value] : KnownCovariates(given)) {
    if (!joint.Find(name)) {
      throw InputError(
          fmt::format("tissue.given.{}: the table has no such covariate among its correlations; "
                      "leave it out, or "
                      "name a table of a population that has it (semblance population)",
                      name));
    }
    known.push_back({name, value});
  }
  if (!silent.empty()) {
    notes.push_back(
        fmt::format("tissue.given: the depth at {} tells nothing of the others, as the "
                    "table does not say how it varies",
                    fmt::join(silent, ", ")));
  }
  return known;
}

// What is known that no subject of the table comes near.
void NoteFarValues(const JointNormal& joint, const std::vector<KnownValue>& known, Notes& notes) {
  for (const KnownValue& value : known) {
    const int at = *joint.Find(value.name);
    const double mean = joint.mean[at], sd = joint.sd[at];
    const double sds = std::abs(value.value - mean) / std::hypot(sd, value.error_sd);
    if (sds > kFarthest_sds) {
      notes.push_back(fmt::format(
          "tissue.given: {} {:.4g} is {:.0f} standard deviations from the table's {:.4g} "
          "± {:.2g}, so the depths given it are extrapolated; check the number",
          value.name, value.value, sds, mean, sd));
    }
  }
}

// The depth of one dowel; false if the table does not say how it varies.
bool Give(const TissueOptions& options, const JointNormal& joint, const ConditionalNormal& expected,
          Dowel& dowel) {
  const std::optional<int> at = joint.Find(dowel.site);
  if (!at) {
    return false;
  }
  dowel.sd_mm = expected.sd[*at];
  dowel.depth_mm = expected.mean[*at];
  if (dowel.sd_mm > 0) {
    dowel.depth_mm = std::max(dowel.depth_mm + options.sds * dowel.sd_mm, kThinnest_mm);
  }
  return true;
}

std::string InWords(const std::vector<KnownValue>& known) {
  std::vector<std::string> words;
  for (const KnownValue& value : known) {
    words.push_back(fmt::format("{} {:.4g}", value.name, value.value));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

bool IsConditioned(const TissueOptions& options) {
  return options.depths == DepthSource::kTable && !options.given.HasNothing();
}

JointNormal JointOfTable(const TissueTable& table, Sex sex, Build build,
                         const SiteCorrelation& model, std::span<const std::string> sites) {
  JointNormal joint;
  std::vector<double> mean, sd;
  const auto add = [&](const std::string& name, double m, double s, int n) {
    joint.names.push_back(name);
    mean.push_back(m);
    sd.push_back(s);
    joint.sample.push_back(n);
  };
  const TissueCorrelations none, &stated = table.correlations ? *table.correlations : none;
  for (const std::string& name :
       table.correlations ? stated.names : std::vector<std::string>(sites.begin(), sites.end())) {
    const auto covariate = std::ranges::find(stated.covariates, name, &TissueCovariate::name);
    const auto depth = FindDepth(table, sex, build, name);
    if (covariate != stated.covariates.end()) {
      add(name, covariate->mean, covariate->sd, stated.subjects);
    } else if (depth && depth->sd_mm && *depth->sd_mm > 0) {
      add(name, depth->mean_mm, *depth->sd_mm,
          stated.subjects == 0 ? 0 : depth->n.value_or(stated.subjects));
    }
  }
  joint.shrinkage = stated.shrinkage;
  joint.mean = Eigen::Map<const Eigen::VectorXd>(mean.data(), std::ssize(mean));
  joint.sd = Eigen::Map<const Eigen::VectorXd>(sd.data(), std::ssize(sd));
  joint.model = joint.correlation = ModelledCorrelation(model, joint.names);
  for (std::size_t i = 0; i < stated.rows.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const auto a = static_cast<Eigen::Index>(i), b = static_cast<Eigen::Index>(j);
      joint.correlation(a, b) = joint.correlation(b, a) = stated.rows[i][j];
    }
  }
  return joint;
}

std::vector<std::string> ConditionDepths(const TissueOptions& options,
                                         const LandmarkFile& landmarks, std::span<Dowel> dowels) {
  Notes notes;
  if (!IsConditioned(options)) {
    return notes;
  }
  const JointNormal joint = JointOf(options);
  const std::map<std::string, double> depths = KnownDepths(options.given, landmarks);
  const std::vector<KnownValue> known = Telling(options.given, joint, depths, notes);
  NoteFarValues(joint, known, notes);
  const ConditionalNormal expected = Condition(joint, known);
  std::vector<std::string> kept;
  for (Dowel& dowel : dowels) {
    const auto own = depths.find(dowel.site);
    if (!SetFor(options, dowel.site).empty()) {
      continue;  // set by hand, and so no table's
    }
    if (!Give(options, joint, expected, dowel)) {
      own == depths.end() ? kept.push_back(dowel.site) : void(dowel.sd_mm = options.given.error_mm);
      dowel.depth_mm = own == depths.end() ? dowel.depth_mm : own->second;
    }
  }
  notes.push_back(fmt::format("tissue depths are those to be expected given {}", InWords(known)));
  if (!kept.empty()) {
    notes.push_back(fmt::format(
        "tissue.given: {} keep the table's depth, which does not say how it varies there",
        fmt::join(kept, ", ")));
  }
  return notes;
}

}  // namespace semblance
