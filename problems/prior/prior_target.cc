// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/prior/prior_target.h"

#include <fmt/format.h>

#include "fitting/problem/placement.h"
#include "surfaces/base/error.h"

namespace semblance {

ShapeTarget PriorTarget(const FacePrior& prior, std::span<const Dowel> dowels,
                        const TableDepthOptions* from_table, const TriMesh* implicit,
                        const std::map<std::string, ModelPoint>& more) {
  ShapeTarget target{.start = {}, .tips = {}, .surface = implicit, .features = prior.features};
  std::vector<Vec3> on_mean, on_subject;
  for (const Dowel& dowel : dowels) {
    const auto own = prior.sites.find(dowel.site);
    const auto at = own != prior.sites.end() ? own : more.find(dowel.site);
    if (own == prior.sites.end() && at == more.end()) {
      continue;
    }
    target.tips.push_back(
        {.label = dowel.site,
         .at = at->second,
         .position = dowel.Tip(),
         .direction = dowel.direction,
         .along_sd_mm = from_table == nullptr ? 0 : DepthSd_mm(*from_table, dowel),
         .shared_sd_mm = from_table == nullptr ? 0 : from_table->shared * PublishedSd_mm(dowel)});
    if (own == prior.sites.end()) {
      continue;
    }
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
