// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/depth_scheme.h"

namespace semblance {

DepthField InterpolateDepth(const DepthScheme& scheme, const DepthInput& input,
                            const RunContext& run) {
  return std::visit([&](const auto& options) { return InterpolateDepth(options, input, run); },
                    scheme);
}

bool NeedsSurface(const DepthScheme& scheme) {
  return std::holds_alternative<Harmonic>(scheme) || std::holds_alternative<Biharmonic>(scheme);
}

}  // namespace semblance
