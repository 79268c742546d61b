// SPDX-License-Identifier: GPL-3.0-or-later
// Marching cubes one layer of cells after the other: two layers of corner values are all that is
// kept of the grid (thesis 3.2.1). For the polygonizers alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "surfaces/marching/edge_intersections.h"

namespace semblance {

// Values start as unknown (NaN). Only corners that were asked for are cleared between layers, so
// that cells which are not visited cost nothing (thesis 3.3).
class SliceMarchingCubes {
 public:
  explicit SliceMarchingCubes(const SampleGrid& grid)
      : grid_(grid),
        lower_(std::size_t(grid.counts[0]) * grid.counts[1], kNaN),
        upper_(lower_.size(), kNaN) {}

  // What was the upper layer of corners becomes the lower one. The first call makes layer 0,
  // unknown or filled before, the lower one.
  void GoUp() {
    std::swap(lower_, upper_);
    std::swap(asked_lower_, asked_upper_);
    for (const std::size_t column : asked_upper_) {
      upper_[column] = kNaN;
    }
    asked_upper_.clear();
    ++slice_;
  }

  // To be filled whole, each time; counts[0] * counts[1] values, i fastest.
  std::span<double> UpperLayer() { return upper_; }

  // Records cell (i, j) of the layer between the two if it is crossed; its corners are known.
  void Cell(int i, int j) {
    Record(i, j, [](CrossedEdge&) {});
  }

  // The same; value(corner) gives the corners that are not known, search(edge) the crossings.
  template <class Value, class Search>
  void Cell(int i, int j, const Value& value, const Search& search) {
    for (int c = 0; c < 8; ++c) {
      const bool upper = (c >> 2 & 1) != 0;
      const GridIndex corner = {i + (c & 1), j + (c >> 1 & 1), slice_ + (upper ? 1 : 0)};
      const std::size_t column = Column(corner[0], corner[1]);
      double& at = (upper ? upper_ : lower_)[column];
      if (std::isnan(at)) {
        at = value(corner);
        (upper ? asked_upper_ : asked_lower_).push_back(column);
        ++intersections_.summary.corner_evaluations;
      }
    }
    Record(i, j, search);
  }

  PolygonizeSummary& Summary() { return intersections_.summary; }

  // Cells in ascending order, whatever the order within a layer was.
  EdgeIntersections Take() {
    std::sort(intersections_.cells.begin(), intersections_.cells.end(),
              [](const CrossedCell& a, const CrossedCell& b) { return a.index < b.index; });
    return std::move(intersections_);
  }

 private:
  std::size_t Column(int i, int j) const { return i + std::size_t(grid_.counts[0]) * j; }
  double At(int i, int j, int c) const {
    return ((c >> 2 & 1) != 0 ? upper_ : lower_)[Column(i + (c & 1), j + (c >> 1 & 1))];
  }

  template <class Search>
  void Record(int i, int j, const Search& search) {
    int mask = 0;
    for (int c = 0; c < 8; ++c) {
      mask |= (At(i, j, c) > 0) << c;
    }
    if (mask == 0 || mask == 255) {
      return;
    }
    const GridIndex cell = {i, j, slice_};
    intersections_.cells.push_back({grid_.Index(cell), static_cast<std::uint8_t>(mask)});
    ForEachOwnEdge(grid_, intersections_.cells.back(), [&](const CellEdge& edge) {
      CrossedEdge crossed{EdgeId(grid_, cell, edge), At(i, j, edge.from), At(i, j, edge.to)};
      search(crossed);
      intersections_.edges.push_back(crossed);
    });
  }

  const SampleGrid& grid_;
  std::vector<double> lower_, upper_;
  std::vector<std::size_t> asked_lower_, asked_upper_;  // columns
  int slice_ = -1;
  EdgeIntersections intersections_;
};

}  // namespace semblance
