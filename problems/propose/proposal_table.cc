// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/propose/proposal_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

const Landmark* Find(const LandmarkFile& file, const std::string& site) {
  const auto found = std::ranges::find(file.landmarks, site, &Landmark::site);
  return found == file.landmarks.end() ? nullptr : &*found;
}

Vec3 PointOf(const Landmark& l) { return {l.point[0], l.point[1], l.point[2]}; }

SiteDifference DifferenceAt(const std::string& site, const Landmark* proposed,
                            const Landmark* placed) {
  SiteDifference difference;
  difference.site = site;
  if (proposed != nullptr && placed != nullptr) {
    difference.error_mm = (PointOf(*proposed) - PointOf(*placed)).norm();
    difference.proposed = proposed->certainty;
  } else {
    difference.remark = proposed != nullptr ? "proposed, and not placed by hand"
                                            : "placed by hand, and not proposed";
  }
  return difference;
}

}  // namespace

ProposalComparison CompareProposal(const LandmarkFile& proposal, const LandmarkFile& placed) {
  ProposalComparison comparison;
  std::vector<double> errors_mm;
  for (const std::string& site : StandardSiteCodes()) {
    const Landmark* const a = Find(proposal, site);
    const Landmark* const b = Find(placed, site);
    if (a != nullptr || b != nullptr) {
      comparison.sites.push_back(DifferenceAt(site, a, b));
      errors_mm.push_back(comparison.sites.back().error_mm);
    }
  }
  const std::vector<WeightedValue> sorted = SortedValues(errors_mm);
  if (sorted.empty()) {
    throw InputError("the landmarks to compare with and the proposal have no site in common");
  }
  comparison.compared = static_cast<int>(sorted.size());
  comparison.median_mm = Quantile(sorted, 0.5);
  comparison.nine_tenths_mm = Quantile(sorted, 0.9);
  comparison.most_mm = Quantile(sorted, 1);
  return comparison;
}

std::string TextOf(const ProposalComparison& comparison) {
  std::string text = fmt::format("{:<7} {:>8}  {}\n", "site", "error mm", "proposed as");
  for (const SiteDifference& s : comparison.sites) {
    text += s.remark.empty()
                ? fmt::format("{:<7} {:>8.1f}  {}\n", s.site, s.error_mm,
                              EnumNames(s.proposed)[static_cast<std::size_t>(s.proposed)])
                : fmt::format("{:<7} {:>8}  {}\n", s.site, "", s.remark);
  }
  return text + fmt::format("{} sites: median {:.1f} mm, 90 % within {:.1f} mm, most {:.1f} mm\n",
                            comparison.compared, comparison.median_mm, comparison.nine_tenths_mm,
                            comparison.most_mm);
}

}  // namespace semblance
