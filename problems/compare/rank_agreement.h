// SPDX-License-Identifier: GPL-3.0-or-later
// Do two studies put the same treatments into the same order? Their subjects may be others:
// phantoms and people, say.
#pragma once

#include <string>
#include <vector>

#include "problems/compare/study_comparison.h"

namespace semblance {

struct RankedTreatment {
  std::string label;
  double reference_mean = kNaN, mean = kNaN;  // of the metric, each over its study's own subjects
  double reference_rank = kNaN, rank = kNaN;  // 1 is best; ties get mean ranks
};

struct RankAgreement {
  std::string metric, reference, study;
  Preference preference = {};
  std::vector<RankedTreatment>
      treatments;          // of the same label in both, best of the reference first
  double spearman = kNaN;  // rank correlation, -1 to 1; NaN below 3 treatments
};

// Over the subjects that have all the treatments that both studies have; which values are better as
// CompareStudies takes it. Throws InputError as CompareStudies, and where the studies have fewer
// than three treatments in common.
RankAgreement CompareRanks(const NamedStudy& reference, const NamedStudy& other,
                           const CompareOptions& options);

// For a terminal: a line for each treatment, then the correlation.
std::string RankText(const RankAgreement& agreement);

}  // namespace semblance
