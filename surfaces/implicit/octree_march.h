// SPDX-License-Identifier: GPL-3.0-or-later
// Marching cubes guided by an octree of emitters (thesis 3.2.2, 3.2.3). Used by polygonizer.cc
// only.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "surfaces/implicit/polygonizer.h"

namespace semblance::surfaces {

// Caches each emitter's value at the corners of the octree's nodes during the march through the
// layers (thesis 3.2.3, fig. 3.4). The depth d of layer k is the smallest depth of a node with a
// corner in it: log2(size) minus the index of the lowest bit of k. Only one layer of each depth
// bounds the nodes that meet the current slice. Hence one layer per depth is kept, and is replaced
// when the march reaches the next. Layer 0 has no lowest bit; its depth is 0, like that of the
// root's upper side, and it is kept separately.
class EmitterCache {
 public:
  // size: cells along the octree's root, a power of 2. Keeps references to surface and grid.
  EmitterCache(const ImplicitSurface& surface, const SampleGrid& grid, int size);

  // Returns the values of emitters (ascending) at a corner of a node. Values that are not cached
  // are evaluated, and their number is added to `evaluations`.
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
  std::vector<Layer> layers_;  // by depth; layer 0 last
};

PolygonizeResult MarchOctree(const McOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context);
PolygonizeResult MarchOctree(const MinMaxOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context);

}  // namespace semblance::surfaces
