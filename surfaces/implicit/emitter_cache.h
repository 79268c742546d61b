// SPDX-License-Identifier: GPL-3.0-or-later
// Each emitter's value at the corners of an octree that is marched through layer by layer (thesis
// 3.2.3, fig. 3.4). For octree_march.cc alone.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "surfaces/emitters/implicit_surface.h"
#include "surfaces/marching/polygonize.h"

namespace semblance {

// A corner (i, j, k) is kept as (i, j, d): d is the least depth of a node of the octree with a
// corner in layer k, log2(size) minus the index of the lowest bit of k. Of all layers of one depth
// a single one bounds the nodes that meet the slice at hand, so one layer per depth is kept, and is
// replaced when the march comes to the next. Layer 0 has no lowest bit; its depth is 0, as is that
// of the root's upper side, so layer 0 is kept apart.
class EmitterCache {
 public:
  // size: cells along the octree's root, a power of 2. Keeps references.
  EmitterCache(const ImplicitSurface& surface, const SampleGrid& grid, int size);

  // The values of emitters, ascending, at a corner of a node. Those that are not kept are evaluated
  // and added to `evaluations`.
  void Get(const GridIndex& corner, std::span<const std::int32_t> emitters,
           std::span<double> values, std::int64_t& evaluations);

 private:
  struct Kept {
    std::vector<std::int32_t> emitters;  // ascending
    std::vector<double> values;
  };
  struct Layer {
    int k = -1;
    std::unordered_map<std::int64_t, Kept> corners;  // by column
  };

  Kept& At(const GridIndex& corner);
  void Insert(const Kept& fresh, Kept& kept) const;

  const ImplicitSurface& surface_;
  const SampleGrid& grid_;
  int size_, depths_;
  std::vector<Layer> layers_;  // by depth; the last is layer 0
};

}  // namespace semblance
