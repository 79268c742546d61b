// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/nearest.h"

#include <algorithm>
#include <limits>

namespace semblance {
namespace {

const Dowel& NearestDowel(std::span<const Dowel> dowels, const Vec3& p) {
  const Dowel* best = &dowels.front();
  double best_distance2 = (best->base - p).squaredNorm();
  for (const Dowel& dowel : dowels.subspan(1)) {
    const double distance2 = (dowel.base - p).squaredNorm();
    if (distance2 < best_distance2 || (distance2 == best_distance2 && dowel.site < best->site)) {
      best = &dowel;
      best_distance2 = distance2;
    }
  }
  return *best;
}

// At each vertex; none on pieces of the skull that are closest to no dowel.
std::vector<const Dowel*> NearestAlong(const DepthInput& input, const RunContext& run) {
  std::vector<const Dowel*> by_site;
  for (const Dowel& dowel : input.dowels) {
    by_site.push_back(&dowel);
  }
  std::ranges::stable_sort(by_site, {}, [](const Dowel* d) { return d->site; });
  std::vector<DepthSample> samples;
  for (const Dowel* dowel : by_site) {
    samples.push_back({dowel->base, dowel->direction, dowel->depth_mm, dowel->sd_mm});
  }
  const std::size_t vertices = input.skull.points.size();
  std::vector<const Dowel*> nearest(vertices, nullptr);
  std::vector<double> least(vertices, std::numeric_limits<double>::infinity());
  ForEachGeodesic(Nearest::kName, input.skull, samples, run,
                  [&](std::size_t k, const std::vector<double>& distance) {
                    for (std::size_t i = 0; i < vertices; ++i) {
                      if (distance[i] < least[i]) {
                        least[i] = distance[i];
                        nearest[i] = by_site[k];
                      }
                    }
                  });
  return nearest;
}

}  // namespace

DepthField InterpolateDepth(const Nearest& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  DepthField field = EmptyDepthField(input.skull.points.size());
  const bool along = options.distance == DowelDistance::kGeodesic;
  const std::vector<const Dowel*> nearest =
      along ? NearestAlong(input, run) : std::vector<const Dowel*>();
  ForEachVertex(input, run, [&](std::size_t i) {
    const Dowel* dowel = along ? nearest[i] : &NearestDowel(input.dowels, input.skull.points[i]);
    if (dowel == nullptr) {
      return;
    }
    if (!Faces(input.normals[i], dowel->direction, options.max_angle_deg)) {
      field.status[i] = DepthStatus::kNotFacing;
      return;
    }
    field.status[i] = DepthStatus::kAssigned;
    field.depth_mm[i] = dowel->depth_mm;
    field.sd_mm[i] = dowel->sd_mm;
  });
  return field;
}

}  // namespace semblance
