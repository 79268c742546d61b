// SPDX-License-Identifier: GPL-3.0-or-later
// Which emitters a point has to sum, found once for all points of a small cube of space. For the
// implicit surface alone.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "surfaces/emitters/distance_kernel.h"
#include "surfaces/emitters/emitter_triangle.h"

namespace semblance {

struct NeighbourList {
  // Runs of 4 or 8 emitters, in the tree's order: each the number of its first over its length.
  std::vector<std::int32_t> runs;
  std::vector<std::int32_t> multipoles;  // four at once, by number
  std::vector<ReachLanes> reaches;       // of the runs, where emitters are summed by distance
};

// Neighbour lists of cubes of a lattice. They are kept in a table of fixed size, where a new one
// may put out an old one: what is found for a point depends on the point alone.
class NeighbourListCache {
 public:
  using List = std::shared_ptr<const NeighbourList>;

  // cube_mm > 0.
  explicit NeighbourListCache(double cube_mm) : cube_mm_(cube_mm), sets_(kSets) {}

  // make(box) gives the list of a cube. Safe from several threads at once.
  template <class Make>
  List Find(const Vec3& p, const Make& make) const {
    const Vec3 cube = (p / cube_mm_).array().floor();
    Set& set = sets_[SetOf(cube)];
    {
      const std::lock_guard lock(set.mutex);
      for (const Slot& slot : set.slots) {
        if (slot.list && slot.cube == cube) {
          return slot.list;
        }
      }
    }
    List list = std::make_shared<const NeighbourList>(make(BoxOf(cube)));
    const std::lock_guard lock(set.mutex);
    set.slots[set.next] = {cube, list};
    set.next = (set.next + 1) % set.slots.size();
    return list;
  }

 private:
  static constexpr std::size_t kSets = 8192;

  struct Slot {
    Vec3 cube = Vec3::Zero();
    List list;
  };
  // Cubes that share a line of the table: with four of them, cubes of one surface, some tens of
  // thousands at most, seldom put each other out.
  struct Set {
    std::mutex mutex;
    std::array<Slot, 4> slots;
    std::size_t next = 0;  // that is filled
  };

  static std::size_t SetOf(const Vec3& cube) {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
      hash += std::bit_cast<std::uint64_t>(cube[axis]);
      hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9ULL;  // splitmix64
      hash = (hash ^ (hash >> 27)) * 0x94D049BB133111EBULL;
      hash ^= hash >> 31;
    }
    return hash % kSets;
  }
  Box3 BoxOf(const Vec3& cube) const {
    const Vec3 low = cube_mm_ * cube;
    const Vec3 slack = Vec3::Constant(kRounding * (cube_mm_ + 1e-3 * low.cwiseAbs().maxCoeff()));
    return {low - slack, low + Vec3::Constant(cube_mm_) + slack};
  }

  double cube_mm_;
  mutable std::vector<Set> sets_;
};

}  // namespace semblance
