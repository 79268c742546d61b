// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/overlay.h"

#include <algorithm>
#include <vector>

#include "surfaces/hspline/bspline_basis.h"

namespace semblance {
namespace {

// The 7 x 7 vertices centred at a place of `center.level` that may lie just outside the net.
Overlay Square(const HSplineShape& shape, const VertexId& center) {
  const int columns = shape.Columns(center.level), rows = shape.Rows(center.level);
  Overlay square;
  for (int j = std::max(center.j - 3, 0); j <= std::min(center.j + 3, rows - 1); ++j) {
    for (int i = center.i - 3; i <= center.i + 3; ++i) {
      if (shape.closure == Closure::kPeriodicU) {
        square.insert({center.level, (i + columns) % columns, j});
      } else if (i >= 0 && i < columns) {
        square.insert({center.level, i, j});
      }
    }
  }
  return square;
}

// The coarser vertices, along one direction, at (one) or next to (two) the finer vertex i.
std::vector<int> CoarserNeighbours(int i) {
  const RefinementRow row = RefineRow(i);
  return i % 2 != 0 ? std::vector{row.index[1]} : std::vector{row.index[0], row.index[1]};
}

}  // namespace

Overlay LocalRefinement(const HSplineShape& shape, const VertexId& coarse) {
  return Square(shape, {coarse.level + 1, 2 * coarse.i - 1, 2 * coarse.j - 1});
}

bool IsEditable(const HSplineShape& shape, const Overlay& overlay, const VertexId& vertex) {
  const Overlay square = Square(shape, vertex);
  return std::includes(overlay.begin(), overlay.end(), square.begin(), square.end());
}

Overlay CompositeOverlay(const HSplineSurface& surface, int level) {
  Overlay composite;
  for (const auto& [vertex, offset] : surface.Offsets(level)) {
    for (const int j : CoarserNeighbours(vertex.j)) {
      for (const int i : CoarserNeighbours(vertex.i)) {
        composite.merge(LocalRefinement(surface.shape(), {level - 1, i, j}));
      }
    }
  }
  return composite;
}

}  // namespace semblance
