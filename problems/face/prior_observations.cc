// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/prior_observations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "fitting/problem/placement.h"
#include "interp/dowels/dowel.h"
#include "problems/subject/tissue_table.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

constexpr double kMeanShareOfDepth = 0.29;  // mean of sd / depth over the sites of that table

}  // namespace

double PublishedSd_mm(const Dowel& dowel) {
  if (std::isfinite(dowel.sd_mm)) {
    return dowel.sd_mm;
  }
  const std::optional<PublishedDepth> published = FindPublishedDepth(dowel.site);
  return published ? published->sd_mm : kMeanShareOfDepth * dowel.depth_mm;
}

double DepthSd_mm(const TableDepthOptions& options, const Dowel& dowel) {
  return options.own * PublishedSd_mm(dowel);
}

namespace {

// The deviation of a dowel's depth in this person. A measured depth is exact unless it states a
// deviation, as an interpolated one does.
double AlongSd_mm(const TableDepthOptions* from_table, const Dowel& dowel) {
  if (from_table != nullptr) {
    return DepthSd_mm(*from_table, dowel);
  }
  return std::isfinite(dowel.sd_mm) ? dowel.sd_mm : 0;
}

}  // namespace

ImplicitSpread ImplicitSpread_mm(const ImplicitSpreadOptions& options, const TriMesh& implicit,
                                 const TriMesh& shell, std::span<const Dowel> dowels,
                                 const TableDepthOptions* table, int threads) {
  const MeshQuery query(shell);
  ImplicitSpread spread{std::vector<double>(implicit.points.size()),
                        std::vector<double>(implicit.points.size())};
  ParallelFor(implicit.points.size(), threads, 256, [&](std::size_t v) {
    const MeshPoint foot = query.Closest(implicit.points[v]);
    const auto squared_mm = [&](const Dowel& d) { return (d.base - foot.position).squaredNorm(); };
    const Dowel& nearest = *std::ranges::min_element(dowels, {}, squared_mm);
    const double beyond_mm = std::max(0.0, std::sqrt(squared_mm(nearest)) - options.reach_mm),
                 own_mm = table == nullptr ? 0 : DepthSd_mm(*table, nearest);
    const double near_mm = std::hypot(options.sd_mm, options.share * foot.distance_mm, own_mm);
    spread.sd[v] = std::hypot(near_mm, options.rate * beyond_mm);
    spread.error[v] = std::hypot(near_mm, options.sigma_rate * beyond_mm);
  });
  return spread;
}

double SeedTrust(const Vec3& p, std::span<const Vec3> tips, std::span<const Sphere> features,
                 const SeedTrustOptions& options) {
  double trust = 1;
  if (!tips.empty()) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& tip : tips) {
      nearest = std::min(nearest, (tip - p).squaredNorm());
    }
    trust = std::exp(-nearest / (options.reach_mm * options.reach_mm));
  }
  for (const Sphere& feature : features) {
    const double radii = (feature.center - p).norm() / feature.radius_mm;
    trust *= std::clamp(radii - 1, 0.0, 1.0);
  }
  return trust;
}

void WeighSeeds(std::span<const Vec3> tips, std::span<const Sphere> features,
                const SeedTrustOptions& options, std::vector<FitPoint>& seeds) {
  constexpr double kLeastTrust = 0.01;  // below, a seed costs time and changes nothing visible
  std::vector<FitPoint> known;
  for (FitPoint& seed : seeds) {
    const double trust = SeedTrust(seed.position, tips, features, options);
    if (trust >= kLeastTrust) {
      seed.weight *= trust;
      known.push_back(std::move(seed));
    }
  }
  seeds = std::move(known);
}

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
         .along_sd_mm = AlongSd_mm(from_table, dowel),
         .shared_sd_mm = from_table == nullptr ? 0 : from_table->shared * PublishedSd_mm(dowel)});
    if (own == prior.sites.end()) {
      continue;
    }
    on_mean.push_back(FindPosition(at->second, prior.model.mean, prior.model.mean.points));
    on_subject.push_back(dowel.Tip());
  }
  if (on_mean.size() < 3) {
    throw InputError(fmt::format(
        "prior: {} dowels have a site on the model's mean; at least 3 are needed", on_mean.size()));
  }
  target.start = PlaceTemplate(on_mean, on_subject);
  return target;
}

}  // namespace semblance::problems
