// SPDX-License-Identifier: GPL-3.0-or-later
// The hierarchical B-spline surface (Forsey & Bartels 1988; thesis ch. 4): bicubic, uniform, dyadic
// levels, detail kept as offsets from the next coarser surface.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "surfaces/control_net.h"

namespace semblance {

enum class Closure { kOpen, kPeriodicU };

// The domain is [0,1] x [0,1]; level L has patches_u 2^L x patches_v 2^L patches.
struct HSplineShape {
  int patches_u = 8;  // of level 0; >= 1 (open), >= 4 (periodic)
  int patches_v = 8;  // of level 0; >= 1
  int max_level = 3;  // finest level that may hold detail; >= 0
  Closure closure = Closure::kOpen;
};

struct SurfaceFrame {
  Vec3 point = Vec3::Constant(kNaN);
  Vec3 du = Vec3::Constant(kNaN);  // first derivatives with respect to u and v in [0,1], mm
  Vec3 dv = Vec3::Constant(kNaN);
  Mat3 axes =
      Mat3::Constant(kNaN);  // columns: unit u-tangent, normal x u-tangent, unit normal (du x dv)
};

struct VertexId {
  int level = -1;
  int i = -1;  // along u
  int j = -1;  // along v
  auto operator<=>(const VertexId&) const = default;
};

}  // namespace semblance
