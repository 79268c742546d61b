// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/mean.h"

#include <algorithm>

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
  DepthField field = EmptyDepthField(input.skull.points.size());
  std::ranges::fill(field.depth_mm, MeanDepth(input.dowels));
  std::ranges::fill(field.status, DepthStatus::kAssigned);
  return field;
}

}  // namespace semblance
