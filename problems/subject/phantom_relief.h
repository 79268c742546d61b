// SPDX-License-Identifier: GPL-3.0-or-later
// The relief of a phantom's bone under a skin that stays smooth: hollows that tissue fills, and a
// rough field, so that depths vary along the bone as people's do.
#pragma once

#include <vector>

#include "problems/subject/phantom_shape.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance {

class PhantomRelief {
 public:
  explicit PhantomRelief(Random& random);  // draws depths of hollows and the rough field

  // The tissue along the smooth bone's normal once the bone has its relief, > 0 for what the smooth
  // bone has, > 0; direction unit, from the rays' centre.
  double Depth(const Vec3& direction, double smooth_depth_mm) const;

 private:
  struct Hollow {  // depth * exp(-|(d - direction) / sigma|^2 / 2)
    Vec3 direction, sigma;
    double depth_mm;
  };

  std::vector<Hollow> hollows_;
  WaveSum rough_;
};

}  // namespace semblance
