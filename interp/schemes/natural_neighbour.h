// SPDX-License-Identifier: GPL-3.0-or-later
// Natural neighbour interpolation: the neighbours of a vertex are the dowels whose Voronoi cells
// would lose area if the vertex were a dowel.
#pragma once

#include <array>
#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

enum class NeighbourWeights { kSibson, kLaplace };
constexpr auto EnumNames(NeighbourWeights) {
  return std::to_array<std::string_view>({"sibson", "laplace"});
}

struct NaturalNeighbour {
  static constexpr std::string_view kName = "natural_neighbour";
  NeighbourWeights weights = NeighbourWeights::kSibson;
  double max_angle_deg = 90;
};
template <class Visitor>
void Fields(Visitor& visit, NaturalNeighbour& o) {
  visit(FieldInfo{.name = "weights",
                  .doc = "weight of a dowel: sibson, the area that its cell would lose to the "
                         "vertex (smooth except at the dowels), or laplace, the common border over "
                         "the distance (with creases, cheaper)"},
        o.weights);
  MaxAngleField(visit, o.max_angle_deg);
}

// The cells are those of the dowels' Voronoi diagram in space, cut by the vertex's tangent plane
// (Boissonnat and Flototto 2002). A linear depth on a plane is reproduced. The depth is always
// within the dowels' range, and a dowel affects only its neighbourhood. sd_mm is averaged with the
// same weights, which assumes fully correlated errors; NaN if a neighbour has none.
//
// kOutside if the vertex's own cell is open or extends beyond four times the distance of the
// furthest dowel, which happens outside the dowels' hull. kNotFacing as in AssignWhereFacing.
// Throws InputError as CheckDepthInput does.
DepthField InterpolateDepth(const NaturalNeighbour& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
