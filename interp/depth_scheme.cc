// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/depth_scheme.h"

namespace semblance {

DepthField InterpolateDepth(const DepthScheme& scheme, const DepthInput& input,
                            const RunContext& run) {
  return std::visit([&](const auto& options) { return InterpolateDepth(options, input, run); },
                    scheme);
}

}  // namespace semblance
