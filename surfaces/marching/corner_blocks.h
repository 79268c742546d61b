// SPDX-License-Identifier: GPL-3.0-or-later
// Values at some corners of a large grid, in blocks that exist only where one was asked for. For
// polygonize.cc alone.
#pragma once

#include <array>
#include <bitset>
#include <memory>
#include <vector>

#include "surfaces/marching/marching_cubes.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

class CornerBlocks {
 public:
  using Place = std::array<int, 3>;

  explicit CornerBlocks(const SampleGrid& grid) {
    for (int axis = 0; axis < 3; ++axis) {
      blocks_[axis] = (grid.counts[axis] + kEdge - 1) / kEdge;
    }
    block_.resize(std::size_t(blocks_[0]) * blocks_[1] * blocks_[2]);
  }

  // What is kept of a cell (by its lowest corner); nothing at first.
  struct Cell {
    EdgeBits edges = 0;
    std::uint8_t mask = 0;
  };
  Cell& CellAt(const Place& cell) { return BlockOf(cell).cells[Within(cell)]; }
  // True the first time for a corner.
  bool FirstAsked(const Place& corner) {
    auto bit = BlockOf(corner).asked[Within(corner)];
    const bool first = !bit;
    bit = true;
    return first;
  }

  // Of corners that were asked for; different corners may be set from several threads at once.
  void Set(const Place& corner, double value) {
    block_[Number(corner)]->value[Within(corner)] = value;
  }
  double Get(const Place& corner) const { return block_[Number(corner)]->value[Within(corner)]; }

 private:
  static constexpr int kEdge = 8, kCorners = kEdge * kEdge * kEdge;
  struct Block {
    std::array<double, kCorners> value;
    std::array<Cell, kCorners> cells{};
    std::bitset<kCorners> asked;
  };

  // Places are not negative, and so divided as unsigned.
  static std::size_t Within(const Place& at) {
    const auto within = [&at](int axis) { return std::size_t(at[axis]) % kEdge; };
    return within(0) + kEdge * (within(1) + kEdge * within(2));
  }
  std::size_t Number(const Place& at) const {
    const auto block = [&at](int axis) { return std::size_t(at[axis]) / kEdge; };
    return block(0) + std::size_t(blocks_[0]) * (block(1) + std::size_t(blocks_[1]) * block(2));
  }
  Block& BlockOf(const Place& at) {
    std::unique_ptr<Block>& block = block_[Number(at)];
    if (!block) {
      block = std::make_unique<Block>();
    }
    return *block;
  }

  std::array<int, 3> blocks_{};
  std::vector<std::unique_ptr<Block>> block_;
};

}  // namespace semblance
