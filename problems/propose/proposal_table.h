// SPDX-License-Identifier: GPL-3.0-or-later
// How far a proposal is from landmarks that a person placed.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"

namespace semblance {

struct SiteDifference {
  std::string site;
  double error_mm = kNaN;  // NaN where only one of the two has it
  Certainty proposed = Certainty::kLow;
  std::string remark;  // who says that the site is absent, and who does not
};

struct ProposalComparison {
  std::vector<SiteDifference> sites;  // in the order of the standard sites
  int compared = 0;
  double median_mm = kNaN, most_mm = kNaN;
  double nine_tenths_mm = kNaN;  // that 90 % do not exceed
};

// Both in mm and one frame. Throws InputError if they have no site in common.
ProposalComparison CompareProposal(const LandmarkFile& proposal, const LandmarkFile& placed);

// For people: a line per site, then the summary.
std::string TextOf(const ProposalComparison& comparison);

}  // namespace semblance
