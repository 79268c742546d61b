// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/condition_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "problems/subject/average_skull.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Lays a point on the left side of the head.
Vec3 Folded(const Vec3& p) { return {std::abs(p.x()), p.y(), p.z()}; }

double CorrelationBetween(const SiteCorrelation& o, const std::string& a, const std::string& b) {
  if (!IsSite(a) || !IsSite(b)) {
    return 0;
  }
  if (!IsStandardSite(a) || !IsStandardSite(b)) {
    return o.common + (WithoutSide(a) == WithoutSide(b) ? o.twins : 0);
  }
  const Vec3 p = AverageSite(a), q = AverageSite(b);
  const double rest = 1 - o.common - o.twins - o.own;
  return o.common + o.twins * std::exp(-(Folded(p) - Folded(q)).norm() / o.length_mm) +
         rest * std::exp(-(p - q).norm() / o.length_mm);
}

using ConditionNotes = std::vector<std::string>;

constexpr double kMinDepth_mm = 0.5;
// Distance from the mean, in sds, beyond which a note warns: no subject of a table is so far out.
constexpr double kMaxDistance_sds = 4;

std::map<std::string, double> KnownCovariates(const TissueGiven& given) {
  std::map<std::string, double> known;
  const auto add = [&](const char* name, const std::optional<double>& value) {
    if (value) {
      known[name] = *value;
    }
  };
  add("sex", given.sex ? std::optional(CovariateValue(*given.sex)) : std::nullopt);
  add("build", given.build ? std::optional(CovariateValue(*given.build)) : given.build_sds);
  add("age_years", given.age_years);
  add("bmi", given.bmi);
  return known;
}

// Replaces the means of the table of spreads by those of the tables in use.
void ReplaceMeans(const TissueOptions& options, JointNormal& joint) {
  std::vector<TissueTable> tables;
  for (const std::filesystem::path& path : TissueTableFiles(options)) {
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

JointNormal ReadDistribution(const TissueOptions& options) {
  const TissueGiven& given = options.given;
  const std::filesystem::path& path = given.spread.empty() ? options.table : given.spread;
  const TissueTable table = ReadTissueTable(path);
  JointNormal joint =
      MakeTableDistribution(table, options.sex, options.build, given.correlation, AllCodes());
  if (joint.names.empty()) {
    throw InputError(fmt::format(
        "tissue.given: table '{}' has no standard deviation, so the variation of depths is "
        "unknown; "
        "name a table that has some under given.spread, such as configs/tables/t_table_2023.yaml",
        table.id));
  }
  if (!given.spread.empty()) {
    ReplaceMeans(options, joint);
  }
  return joint;
}

// The known values that the distribution can use. A known site may be unknown to the table, which
// gives a note; an unknown covariate is an error.
std::vector<KnownValue> UsableValues(const TissueGiven& given, const JointNormal& joint,
                                     const std::map<std::string, double>& depths,
                                     ConditionNotes& notes) {
  std::vector<KnownValue> known;
  std::vector<std::string> unused;
  for (const auto& [site, depth_mm] : depths) {
    joint.Find(site) ? known.push_back({site, depth_mm, given.error_mm}) : unused.push_back(site);
  }
  for (const auto& [name, value] : KnownCovariates(given)) {
    if (!joint.Find(name)) {
      throw InputError(
          fmt::format("tissue.given.{}: the table has no such covariate among its correlations; "
                      "leave it out, or name a table of a population that has it (semblance "
                      "population)",
                      name));
    }
    known.push_back({name, value});
  }
  if (!unused.empty()) {
    notes.push_back(
        fmt::format("tissue.given: the depth at {} does not change the other depths, because the "
                    "table has no standard deviation for it",
                    fmt::join(unused, ", ")));
  }
  return known;
}

// Notes known values that are far from those of all subjects of the table.
void NoteFarValues(const JointNormal& joint, const std::vector<KnownValue>& known,
                   ConditionNotes& notes) {
  for (const KnownValue& value : known) {
    const int at = *joint.Find(value.name);
    const double mean = joint.mean[at], sd = joint.sd[at];
    const double sds = std::abs(value.value - mean) / std::hypot(sd, value.error_sd);
    if (sds > kMaxDistance_sds) {
      notes.push_back(fmt::format(
          "tissue.given: {} {:.4g} is {:.0f} standard deviations from the table's {:.4g} "
          "± {:.2g}, so the conditioned depths are extrapolated; check the number",
          value.name, value.value, sds, mean, sd));
    }
  }
}

// Sets the depth of one dowel; returns false if the distribution does not include its site.
bool SetExpectedDepth(const TissueOptions& options, const JointNormal& joint,
                      const ConditionalNormal& expected, Dowel& dowel) {
  const std::optional<int> at = joint.Find(dowel.site);
  if (!at) {
    return false;
  }
  dowel.sd_mm = expected.sd[*at];
  dowel.depth_mm = expected.mean[*at];
  if (dowel.sd_mm > 0) {
    dowel.depth_mm = std::max(dowel.depth_mm + options.sds * dowel.sd_mm, kMinDepth_mm);
  }
  return true;
}

std::string ListValues(const std::vector<KnownValue>& known) {
  std::vector<std::string> words;
  for (const KnownValue& value : known) {
    words.push_back(fmt::format("{} {:.4g}", value.name, value.value));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

}  // namespace

Eigen::MatrixXd ModelledCorrelation(const SiteCorrelation& options,
                                    std::span<const std::string> names) {
  const auto size = static_cast<Eigen::Index>(names.size());
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      correlation(i, j) = correlation(j, i) = CorrelationBetween(options, names[i], names[j]);
    }
  }
  return correlation;
}

bool IsConditioned(const TissueOptions& options) {
  return options.depths == DepthSource::kTable && !options.given.HasNothing();
}

JointNormal MakeTableDistribution(const TissueTable& table, Sex sex, Build build,
                                  const SiteCorrelation& model,
                                  std::span<const std::string> sites) {
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
  ConditionNotes notes;
  if (!IsConditioned(options)) {
    return notes;
  }
  const JointNormal joint = ReadDistribution(options);
  const std::map<std::string, double> depths = KnownDepths(options.given, landmarks);
  const std::vector<KnownValue> known = UsableValues(options.given, joint, depths, notes);
  NoteFarValues(joint, known, notes);
  const ConditionalNormal expected = Condition(joint, known);
  std::vector<std::string> kept;
  for (Dowel& dowel : dowels) {
    const auto own = depths.find(dowel.site);
    if (!FindSetKey(options, dowel.site).empty()) {
      continue;  // set by hand, not by a table
    }
    if (!SetExpectedDepth(options, joint, expected, dowel)) {
      own == depths.end() ? kept.push_back(dowel.site) : void(dowel.sd_mm = options.given.error_mm);
      dowel.depth_mm = own == depths.end() ? dowel.depth_mm : own->second;
    }
  }
  notes.push_back(fmt::format("tissue depths are those expected given {}", ListValues(known)));
  if (!kept.empty()) {
    notes.push_back(
        fmt::format("tissue.given: {} keep the table's depth, because the table has no standard "
                    "deviation there",
                    fmt::join(kept, ", ")));
  }
  return notes;
}

}  // namespace semblance::problems
