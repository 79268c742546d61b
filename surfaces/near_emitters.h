// SPDX-License-Identifier: GPL-3.0-or-later
// Which emitters a point has to sum, found once for all points of a small cube of space. For
// implicit_surface.cc alone.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "surfaces/emitter_triangle.h"

namespace semblance {

// Runs of four emitters, each by the number of its first over four, in the tree's order.
using NearEmitters = std::vector<std::int32_t>;

// Lists of cubes of a lattice. They are kept in a table of fixed size, where a new one may put out
// an old one: what is found for a point depends on the point alone.
class NearEmittersTable {
 public:
  using List = std::shared_ptr<const NearEmitters>;

  // cube_mm > 0.
  explicit NearEmittersTable(double cube_mm) : cube_mm_(cube_mm), slots_(kSlots) {}

  // make(box) gives the list of a cube. Safe from several threads at once.
  template <class Make>
  List Find(const Vec3& p, const Make& make) const {
    const Vec3 cube = (p / cube_mm_).array().floor();
    Slot& slot = slots_[SlotOf(cube)];
    {
      const std::lock_guard lock(slot.mutex);
      if (slot.list && slot.cube == cube) {
        return slot.list;
      }
    }
    List list = std::make_shared<const NearEmitters>(make(BoxOf(cube)));
    const std::lock_guard lock(slot.mutex);
    slot.cube = cube;
    slot.list = list;
    return list;
  }

 private:
  static constexpr std::size_t kSlots = 16384;  // a power of 2

  struct Slot {
    std::mutex mutex;
    Vec3 cube = Vec3::Zero();
    List list;
  };

  static std::size_t SlotOf(const Vec3& cube) {
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(cube[axis])) * 0x9E3779B97F4A7C15ULL;
      hash ^= hash >> 32;
    }
    return hash % kSlots;
  }
  Box3 BoxOf(const Vec3& cube) const {
    const Vec3 low = cube_mm_ * cube;
    const Vec3 slack = Vec3::Constant(kRounding * (cube_mm_ + 1e-3 * low.cwiseAbs().maxCoeff()));
    return {low - slack, low + Vec3::Constant(cube_mm_) + slack};
  }

  double cube_mm_;
  mutable std::vector<Slot> slots_;
};

}  // namespace semblance
