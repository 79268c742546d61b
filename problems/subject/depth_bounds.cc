// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/depth_bounds.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <utility>

#include "problems/subject/dowel_depths.h"

namespace semblance::problems {
namespace {

bool Means(const std::string& code, const std::string& site) {
  return code == site || code == WithoutSide(site);
}

std::string RangeWords(const DepthRange& range) {
  if (range.most_bound < 0) {
    return fmt::format("at least {} mm", range.least_mm);
  }
  return range.least_bound < 0 ? fmt::format("at most {} mm", range.most_mm)
                               : fmt::format("{} to {} mm", range.least_mm, range.most_mm);
}

std::string BoundWords(const DepthRange& range) {
  const int first = range.least_bound < 0 ? range.most_bound : range.least_bound;
  return range.most_bound < 0 || range.most_bound == first
             ? fmt::format("tissue.bounds[{}]", first)
             : fmt::format("tissue.bounds[{}] and [{}]", first, range.most_bound);
}

// Adds one fault for each two bounds without a common depth at a site.
void AddContradictions(std::span<const DepthBound> bounds, std::vector<OptionFault>& faults) {
  std::set<std::pair<int, int>> known;
  for (const std::string& site : StandardSiteCodes()) {
    const DepthRange range = AllowedAt(bounds, site);
    if (range.least_mm > range.most_mm &&
        known.emplace(range.least_bound, range.most_bound).second) {
      faults.push_back(
          {fmt::format("bounds[{}].least_mm", range.least_bound),
           fmt::format("at {} it is {} mm, and tissue.bounds[{}] allows at most {} "
                       "mm, so no depth is allowed; correct one of them",
                       DescribeSite(site), range.least_mm, range.most_bound, range.most_mm)});
    }
  }
}

// Adds a fault for each depth of `option` that is not allowed. The depth of a pair does not apply
// at a side that has its own.
void AddForbidden(const char* option, const std::map<std::string, double>& depths_mm,
                  std::span<const DepthBound> bounds, std::vector<OptionFault>& faults) {
  for (const auto& [code, depth_mm] : depths_mm) {
    for (const std::string& site : StandardSiteCodes()) {
      const DepthRange range = AllowedAt(bounds, site);
      const bool applies = Means(code, site) && (code == site || !depths_mm.contains(site));
      if (applies && !range.Contains(depth_mm)) {
        faults.push_back({fmt::format("{}.{}", option, code), KnownDepthFault(depth_mm, range)});
        break;
      }
    }
  }
}

}  // namespace

double DepthRange::LimitedSd(double sd_mm) const {
  const double most_sd_mm = (most_mm - least_mm) / 2;
  return sd_mm > most_sd_mm ? most_sd_mm : sd_mm;
}

std::string DepthRange::Words() const {
  return fmt::format("{} ({})", RangeWords(*this), BoundWords(*this));
}

std::string KnownDepthFault(double depth_mm, const DepthRange& range) {
  return fmt::format("the known depth of {} mm is not within {}; correct one of them", depth_mm,
                     range.Words());
}

std::string BoundSiteFault(const std::string& code) {
  for (const Site& site : StandardSites()) {
    if (Means(code, site.code)) {
      return "";
    }
  }
  return StandardSiteFault(std::string_view(code));
}

bool HoldsAt(const DepthBound& bound, const std::string& site) {
  const auto means = [&site](const std::string& code) { return Means(code, site); };
  return std::ranges::any_of(bound.sites, means) ||
         (bound.region && FacePartOfSite(site) == static_cast<int>(*bound.region));
}

DepthRange AllowedAt(std::span<const DepthBound> bounds, const std::string& site) {
  DepthRange range;
  for (int k = 0; k < std::ssize(bounds); ++k) {
    const DepthBound& bound = bounds[k];
    if (!HoldsAt(bound, site)) {
      continue;
    }
    if (bound.least_mm.value_or(0) > range.least_mm) {
      range.least_mm = *bound.least_mm;
      range.least_bound = k;
    }
    if (bound.most_mm && *bound.most_mm < range.most_mm) {
      range.most_mm = *bound.most_mm;
      range.most_bound = k;
    }
  }
  return range;
}

std::vector<BoundEffect> StartEffects(std::span<const DepthBound> bounds) {
  std::vector<BoundEffect> effects;
  for (const DepthBound& bound : bounds) {
    std::vector<std::string> names = bound.sites;
    if (bound.region) {
      names.insert(names.begin(), kFaceParts[static_cast<int>(*bound.region)]);
    }
    effects.push_back({.name = fmt::format("{}", fmt::join(names, ", ")),
                       .least_mm = bound.least_mm,
                       .most_mm = bound.most_mm,
                       .dowels = {}});
  }
  return effects;
}

std::vector<OptionFault> BoundFaults(const TissueOptions& tissue) {
  std::vector<OptionFault> faults;
  AddContradictions(tissue.bounds, faults);
  if (faults.empty()) {
    AddForbidden("set_mm", tissue.set_mm, tissue.bounds, faults);
    AddForbidden("given.depths_mm", tissue.given.depths_mm, tissue.bounds, faults);
  }
  return faults;
}

}  // namespace semblance::problems
