// SPDX-License-Identifier: GPL-3.0-or-later
// Natural neighbours: the dowels whose cells a vertex would take from, were it a dowel itself.
#pragma once

#include <array>
#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance {

enum class NeighbourWeights { kSibson, kLaplace };
constexpr auto EnumNames(NeighbourWeights) {
  return std::to_array<std::string_view>({"sibson", "laplace"});
}

struct NaturalNeighbour {
  static constexpr std::string_view kName = "natural_neighbour";
  NeighbourWeights weights = NeighbourWeights::kSibson;  // laplace is cheaper, but creased
  double max_angle_deg = 90;                             // further turned bone gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, NaturalNeighbour& o) {
  visit(FieldInfo{.name = "weights",
                  .doc = "of a dowel: sibson, the area its cell would lose to the vertex (smooth "
                         "but at the dowels), or laplace, the common border over the distance "
                         "(with creases, cheaper)"},
        o.weights);
  MaxAngleField(visit, o.max_angle_deg);
}

// The cells are those of the dowels' Voronoi diagram in space, cut by the vertex's tangent plane
// (Boissonnat and Flototto 2002). A depth linear on a plane is reproduced there; always within the
// dowels' range; a dowel has no effect beyond its neighbours. sd_mm is averaged alike, as if the
// dowels deviated together; NaN if one of the neighbours has none.
//
// kOutside where the vertex's own cell would be open, or reach beyond four times the furthest
// dowel's distance: outside the dowels' hull. kNotFacing as AssignWhereFacing. Throws InputError as
// CheckDepthInput.
DepthField InterpolateDepth(const NaturalNeighbour& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
