// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/prior_target.h"

#include <fmt/format.h>

#include <cmath>

#include "fitting/problem/placement.h"
#include "surfaces/base/error.h"

namespace semblance {

double DepthSd_mm(const TableDepthOptions& options, const Dowel& dowel) {
  return std::hypot(options.sd_mm, options.share * dowel.depth_mm);
}

ShapeTarget PriorTarget(const FacePrior& prior, std::span<const Dowel> dowels,
                        const TableDepthOptions* from_table, const TriMesh* implicit) {
  ShapeTarget target{.start = {}, .tips = {}, .surface = implicit, .features = prior.features};
  std::vector<Vec3> on_mean, on_subject;
  for (const Dowel& dowel : dowels) {
    const auto at = prior.sites.find(dowel.site);
    if (at == prior.sites.end()) {
      continue;
    }
    const double along_sd_mm = from_table == nullptr ? 0 : DepthSd_mm(*from_table, dowel);
    const double stated_sd_mm = std::isfinite(dowel.sd_mm) ? dowel.sd_mm : along_sd_mm;
    target.tips.push_back(
        {.label = dowel.site,
         .at = at->second,
         .position = dowel.Tip(),
         .direction = dowel.direction,
         .along_sd_mm = along_sd_mm,
         .shared_sd_mm = from_table == nullptr ? 0 : from_table->shared * stated_sd_mm});
    on_mean.push_back(PositionOf(at->second, prior.model.mean, prior.model.mean.points));
    on_subject.push_back(dowel.Tip());
  }
  if (on_mean.size() < 3) {
    throw InputError(fmt::format(
        "prior: {} dowels have a site on the model's mean; at least 3 are needed", on_mean.size()));
  }
  target.start = PlaceTemplate(on_mean, on_subject);
  return target;
}

}  // namespace semblance
