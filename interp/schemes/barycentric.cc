// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/barycentric.h"

namespace semblance {

DepthField InterpolateDepth(const Barycentric& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DowelArea> areas = DowelAreas(Barycentric::kName, input);
  return AssignInAreas(
      areas, options.distance, options.max_angle_deg, input, run,
      [&](const AreaPoint& in, const Vec3&) {
        const auto& [a, b, c] = in.area->dowels;
        return in.weights.dot(
            Vec3(input.dowels[a].depth_mm, input.dowels[b].depth_mm, input.dowels[c].depth_mm));
      });
}

}  // namespace semblance
