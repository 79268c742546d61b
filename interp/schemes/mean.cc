// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/mean.h"

#include <vector>

namespace semblance {

double MeanDepth(std::span<const Dowel> dowels) {
  double sum = 0;
  for (const Dowel& dowel : dowels) {
    sum += dowel.depth_mm;
  }
  return sum / static_cast<double>(dowels.size());
}

DepthField InterpolateDepth(const Mean&, const DepthInput& input, const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  const std::size_t vertices = input.skull.points.size();  // each vector is written once
  return {std::vector<double>(vertices, MeanDepth(input.dowels)),
          std::vector<DepthStatus>(vertices, DepthStatus::kAssigned),
          std::vector<double>(vertices, kNaN)};
}

}  // namespace semblance
