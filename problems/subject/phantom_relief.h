// SPDX-License-Identifier: GPL-3.0-or-later
// The relief of a phantom's bone under a skin that stays smooth: hollows that tissue fills, and a
// rough field, so that depths vary along the bone as people's do. How deep and how rough: by the
// variograms of true depths of three heads (docs/interpolation.md).
#pragma once

#include <vector>

#include "problems/subject/phantom_shape.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance {

class PhantomRelief {
 public:
  explicit PhantomRelief(Random& random);  // draws depths of hollows and the rough field

  // Tissue along the smooth bone's normal once the bone has its relief, mm, > 0. direction: unit,
  // from the rays' centre; smooth_depth_mm > 0: the tissue over the smooth bone there.
  double Depth(const Vec3& direction, double smooth_depth_mm) const;

 private:
  std::vector<PhantomBump> hollows_;
  WaveSum rough_;
};

}  // namespace semblance
