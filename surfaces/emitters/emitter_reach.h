// SPDX-License-Identifier: GPL-3.0-or-later
// The most that emitters give anywhere in a box, for eight at once: a quick bound, for leaving out
// those that are too far.
#pragma once

#include <array>

#include "surfaces/emitters/emitter_triangle.h"

namespace semblance {

// gain / distance^power, where by_height times the height over the triangle's plane; nothing where
// that is less than the cut.
struct ReachFall {
  double power = kNaN;  // > 0
  int whole = -1;       // the power if it is whole
  bool by_height = false;
  double cut = 0;
};

// Triangles side by side, one a lane.
struct alignas(64) EmitterReach {
  static constexpr int kLanes = 8;
  using Lanes = std::array<double, kLanes>;

  void Set(int lane, const EmitterTriangle& t);

  std::array<Lanes, 3> low{}, high{};  // a box of where it emits from
  std::array<Lanes, 3> moved{};        // to there
  std::array<Lanes, 3> normal{};
  Lanes offset_mm{};  // of the plane along the normal
  Lanes gain{};
};

// Not less than what each lane emits anywhere within `half`, each way, of the center; infinity
// where the triangle, or the way along which it was moved, may meet that box. Of no use for lanes
// that were not set.
void MostInBox(const EmitterReach& batch, const Vec3& center, const Vec3& half,
               const ReachFall& fall, EmitterReach::Lanes& most);

}  // namespace semblance
