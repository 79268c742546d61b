// SPDX-License-Identifier: GPL-3.0-or-later
// Values at some corners of a large grid, in blocks of 8^3 that exist only where a corner was asked
// for. For polygonize.cc alone.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "surfaces/marching/marching_cubes.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

class SparseGrid {
 public:
  explicit SparseGrid(const SampleGrid& grid) {
    for (int axis = 0; axis < 3; ++axis) {
      counts_[axis] = (grid.counts[axis] + kEdge - 1) / kEdge;
    }
    blocks_.resize(std::size_t(counts_[0]) * counts_[1] * counts_[2]);
  }

  // What is kept of a cell, by its lowest corner; nothing at first.
  struct CellRecord {
    EdgeBits edges = 0;
    std::uint8_t mask = 0;
  };
  CellRecord& CellAt(const GridIndex& cell) { return BlockOf(cell).cells[Within(cell)]; }
  // True the first time for a corner.
  bool FirstAsked(const GridIndex& corner) {
    auto bit = BlockOf(corner).asked[Within(corner)];
    const bool first = !bit;
    bit = true;
    return first;
  }

  // Of corners that were asked for; different corners may be set from several threads at once.
  void Set(const GridIndex& corner, double value) {
    blocks_[Number(corner)]->value[Within(corner)] = value;
  }
  double Get(const GridIndex& corner) const {
    return blocks_[Number(corner)]->value[Within(corner)];
  }

 private:
  static constexpr int kEdge = 8, kCorners = kEdge * kEdge * kEdge;
  struct Block {
    std::array<double, kCorners> value;
    std::array<CellRecord, kCorners> cells{};
    std::bitset<kCorners> asked;
  };

  // Indices are not negative, and so divided as unsigned.
  static std::size_t Within(const GridIndex& at) {
    const auto within = [&at](int axis) { return std::size_t(at[axis]) % kEdge; };
    return within(0) + kEdge * (within(1) + kEdge * within(2));
  }
  std::size_t Number(const GridIndex& at) const {
    const auto block = [&at](int axis) { return std::size_t(at[axis]) / kEdge; };
    return block(0) + std::size_t(counts_[0]) * (block(1) + std::size_t(counts_[1]) * block(2));
  }
  Block& BlockOf(const GridIndex& at) {
    std::unique_ptr<Block>& block = blocks_[Number(at)];
    if (!block) {
      block = std::make_unique<Block>();
    }
    return *block;
  }

  GridIndex counts_{};  // of blocks
  std::vector<std::unique_ptr<Block>> blocks_;
};

}  // namespace semblance
