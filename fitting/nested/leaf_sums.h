// SPDX-License-Identifier: GPL-3.0-or-later
// The points of one leaf patch: what they add to the normal equations, and what is left of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "fitting/nested/nested_points.h"

namespace semblance {

struct LeafPatch {
  int level = -1, i = -1, j = -1;
};

// A point's displacement less the surface's.
struct NestedResidual {
  std::array<double, 3> along{};  // each channel, mm
  double Square() const { return along[0] * along[0] + along[1] * along[1] + along[2] * along[2]; }
};

struct LeafSums {
  Matrix16 gram;                                  // sum of w N_k N_l
  std::array<std::array<double, 16>, 4> right{};  // sum of w N_k value; of the probe last
  double weight = 0;                              // sum of w
  double squares = 0;                             // sum of w |value|^2
};
// Over points of a leaf. With one more channel: sqrt(w) times a random sign per point (ProbeSign).
LeafSums SumsOver(const NestedPoints& points, const LeafPatch& leaf,
                  std::span<const std::uint32_t> indices);

// By a point's place along the curve, so that it does not depend on the order as given.
double ProbeSign(std::uint32_t k);

// The sixteen vertices of a patch, of each channel.
using LeafVertices = std::array<std::array<double, 16>, 3>;
// One per index.
void ResidualsOver(const NestedPoints& points, const LeafPatch& leaf, const LeafVertices& vertices,
                   std::span<const std::uint32_t> indices, NestedResidual* residuals);

}  // namespace semblance
