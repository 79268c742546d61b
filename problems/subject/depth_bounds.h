// SPDX-License-Identifier: GPL-3.0-or-later
// Expert knowledge of one person's tissue depth: limits at sites or in parts of the face, in place
// of a depth.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/subject/sites.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// A bound holds on the bone that is nearer to one of its standard sites than to any other.
struct DepthBound {
  std::vector<std::string> sites;
  std::optional<FacePart> region;  // its sites, as those of `sites`
  std::optional<double> least_mm, most_mm;
};
template <class Visitor>
void Fields(Visitor& visit, DepthBound& o) {
  visit(FieldInfo{.name = "sites",
                  .doc = "standard sites, e.g. [zy, mp]; a pair's code without side means both "
                         "sides. The bound holds on the bone that is nearer to them than to any "
                         "other standard site"},
        o.sites);
  visit(FieldInfo{.name = "region", .doc = "part of the face, which stands for all its sites"},
        o.region);
  visit(FieldInfo{.name = "least_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "least depth there; null: none"},
        o.least_mm);
  visit(FieldInfo{.name = "most_mm",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "largest depth there; null: none"},
        o.most_mm);
}

// The fault of a code in `sites`; empty if it is a standard site or a pair of them.
std::string BoundSiteFault(const std::string& code);

template <class Report>
void CheckValue(Report& report, const DepthBound& o) {
  if (o.sites.empty() && !o.region) {
    report("sites", "the bound holds nowhere; give `sites` or `region`");
  }
  if (!o.least_mm && !o.most_mm) {
    report("least_mm", "the bound limits nothing; give `least_mm`, `most_mm` or both");
  }
  if (o.least_mm && o.most_mm && *o.least_mm > *o.most_mm) {
    report("least_mm", "it is above `most_mm`, so no depth is allowed; exchange or correct them");
  }
  for (const std::string& site : o.sites) {
    if (const std::string fault = BoundSiteFault(site); !fault.empty()) {
      report("sites", fault);
    }
  }
}

// The depths that all bounds together allow at a place.
struct DepthRange {
  double least_mm = 0;
  double most_mm = std::numeric_limits<double>::infinity();
  int least_bound = -1, most_bound = -1;  // indices of the bounds that state them; -1: none does

  bool Contains(double depth_mm) const { return depth_mm >= least_mm && depth_mm <= most_mm; }
  double Limited(double depth_mm) const { return std::clamp(depth_mm, least_mm, most_mm); }
  // The standard deviation of a depth in the range: it is at most half the range's width (Popoviciu
  // 1935). NaN stays NaN.
  double LimitedSd(double sd_mm) const;
  // "4 to 12 mm (tissue.bounds[0])".
  std::string Words() const;
};

// The fault of a known depth that the range does not contain.
std::string KnownDepthFault(double depth_mm, const DepthRange& range);

// True if the bound holds at the standard site, a code with side.
bool HoldsAt(const DepthBound& bound, const std::string& site);

// The range at a standard site. Bounds must not contradict each other (BoundFaults).
DepthRange AllowedAt(std::span<const DepthBound> bounds, const std::string& site);

// The effect of a bound on one person's depths.
struct BoundEffect {
  std::string name;  // its region and sites: "cheeks, mp"
  std::optional<double> least_mm, most_mm;
  std::vector<std::string> dowels;  // sites of the dowels that it moved
  double bone_cm2 = kNaN;           // area of the bone with a depth, where it holds
  double moved_share = kNaN;        // share of that area whose interpolated depth it moved
  double largest_move_mm = kNaN;    // of a vertex of the bone
};

// Effects without any, one per bound.
std::vector<BoundEffect> StartEffects(std::span<const DepthBound> bounds);

struct TissueOptions;
// Faults between the bounds, and of depths that were set by hand and that they do not allow. Paths
// are those of `tissue`: "bounds[1].least_mm", "set_mm.zy".
std::vector<OptionFault> BoundFaults(const TissueOptions& tissue);

}  // namespace semblance::problems
