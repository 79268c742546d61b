// SPDX-License-Identifier: GPL-3.0-or-later
// A dowel (thesis def. 2.1): a base on the bone, a direction out of it, and the depth of the tissue
// along it.
#pragma once

#include <string>

#include "surfaces/base/geometry.h"
#include "surfaces/base/point_role.h"

namespace semblance {

struct Dowel {
  std::string site;                       // landmark code with side, e.g. "g", "go_l", "go_r"
  Vec3 base = Vec3::Constant(kNaN);       // on the skull, mm
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
  double depth_mm = kNaN;                 // tissue depth, > 0
  double sd_mm = kNaN;  // standard deviation of depth_mm where the table gives one, else NaN
  PointRole role = PointRole::kLandmark;

  Vec3 Tip() const { return base + depth_mm * direction; }
};

}  // namespace semblance
