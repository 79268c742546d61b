// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/nearest.h"

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

}  // namespace

DepthField InterpolateDepth(const Nearest& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  DepthField field = EmptyDepthField(input.skull.points.size());
  ForEachVertex(input, run, [&](std::size_t i) {
    const Dowel& dowel = NearestDowel(input.dowels, input.skull.points[i]);
    if (!Faces(input.normals[i], dowel.direction, options.max_angle_deg)) {
      field.status[i] = DepthStatus::kNotFacing;
      return;
    }
    field.status[i] = DepthStatus::kAssigned;
    field.depth_mm[i] = dowel.depth_mm;
    field.sd_mm[i] = dowel.sd_mm;
  });
  return field;
}

}  // namespace semblance
