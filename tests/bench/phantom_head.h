// SPDX-License-Identifier: GPL-3.0-or-later
// The heads on which the implicit face is measured.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "problems/subject/phantom.h"

namespace semblance::bench {
using namespace problems;

struct Head {
  TriMesh skull;
  std::vector<double> depth_mm;
};

inline Head PhantomHead(int rings) {
  Phantom phantom = MakePhantom({.random_seed = 1, .rings = rings});
  return {std::move(phantom.skull), std::move(phantom.depth_mm)};
}

// About 10, 40 and 160 thousand triangles.
inline constexpr std::array<int, 3> kRings = {58, 115, 231};

}  // namespace semblance::bench
