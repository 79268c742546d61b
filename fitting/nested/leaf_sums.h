// SPDX-License-Identifier: GPL-3.0-or-later
// Sums over the points of one leaf: their contributions to the normal equations, and their
// residuals.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "fitting/nested/nested_points.h"

namespace semblance::fitting {

struct LeafPatch {
  int level = -1, i = -1, j = -1;
};

// The residual of a point: its displacement less the surface's.
struct NestedResidual {
  std::array<double, 3> along{};  // per channel, mm
  double Square() const { return along[0] * along[0] + along[1] * along[1] + along[2] * along[2]; }
};

// The residual, equally likely, of a point of mean weight.
inline NestedResidual ScaledResidual(const NestedPoints& points, std::size_t k,
                                     NestedResidual residual) {
  for (double& along : residual.along) {
    along *= points.Scale(k);
  }
  return residual;
}

struct LeafSums {
  Matrix16 gram;                                  // sum of w N_k N_l
  std::array<std::array<double, 16>, 4> right{};  // sum of w N_k value; the probe is last
  double weight = 0;                              // sum of w
  double squares = 0;                             // sum of w |value|^2
};
// The sums over points of a leaf, with the probe as an additional channel: w value is then sqrt(w)
// times a random sign per point (ProbeSign).
LeafSums SumsOver(const NestedPoints& points, const LeafPatch& leaf,
                  std::span<const std::uint32_t> indices);

// A random sign for the point at place k of the curve; it does not depend on the given order.
double ProbeSign(std::uint32_t k);

// The sixteen vertices of a patch, per channel.
using LeafVertices = std::array<std::array<double, 16>, 3>;
// Computes the residuals of the points with these indices.
void ResidualsOver(const NestedPoints& points, const LeafPatch& leaf, const LeafVertices& vertices,
                   std::span<const std::uint32_t> indices, NestedResidual* residuals);

}  // namespace semblance::fitting
