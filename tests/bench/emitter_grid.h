// SPDX-License-Identifier: GPL-3.0-or-later
// A field accelerated as its user would who has no library for it: a uniform grid, each cell with
// the emitters whose box of influence (thesis 3.2.2) reaches it, summed one by one.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "surfaces/emitters/implicit_surface.h"

namespace semblance::bench {
using namespace problems;

// Sums all emitters that emit more than 1 / m: with `cut_below` = 1 / m it is the same field.
class EmitterGrid {
 public:
  EmitterGrid(const ImplicitSurface& surface, const Box3& box, double cell_mm, double m)
      : surface_(surface), low_(box.min()), cell_mm_(cell_mm) {
    for (int axis = 0; axis < 3; ++axis) {
      counts_[axis] = static_cast<int>(std::ceil(box.sizes()[axis] / cell_mm)) + 1;
    }
    cells_.resize(static_cast<std::size_t>(counts_[0]) * counts_[1] * counts_[2]);
    for (std::int32_t e = 0; e < surface.EmitterCount(); ++e) {
      Insert(e, surface.InfluenceBox(e, m));
    }
  }

  double Flattened(const Vec3& p) const {
    const std::array<int, 3> at = CellOf(p);
    return surface_.FlattenAt(p, surface_.SumEmissions(cells_[Index(at[0], at[1], at[2])], p));
  }

 private:
  std::array<int, 3> CellOf(const Vec3& p) const {
    std::array<int, 3> cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] =
          std::clamp(static_cast<int>((p[axis] - low_[axis]) / cell_mm_), 0, counts_[axis] - 1);
    }
    return cell;
  }
  std::size_t Index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * counts_[1] + j) * counts_[0] + i;
  }
  void Insert(std::int32_t emitter, const Box3& reach) {
    const std::array<int, 3> first = CellOf(reach.min()), last = CellOf(reach.max());
    for (int k = first[2]; k <= last[2]; ++k) {
      for (int j = first[1]; j <= last[1]; ++j) {
        for (int i = first[0]; i <= last[0]; ++i) {
          cells_[Index(i, j, k)].push_back(emitter);
        }
      }
    }
  }

  const ImplicitSurface& surface_;
  Vec3 low_;
  double cell_mm_;
  std::array<int, 3> counts_{};
  std::vector<std::vector<std::int32_t>> cells_;
};

}  // namespace semblance::bench
