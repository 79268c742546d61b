// SPDX-License-Identifier: GPL-3.0-or-later
// The relief of a phantom's bone under a skin that stays smooth: hollows that muscle and fat fill,
// prominences that they cover thinly, a person's weight, and roughness.
#pragma once

#include <vector>

#include "problems/subject/phantom_shape.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance {

class PhantomRelief {
 public:
  explicit PhantomRelief(Random& random);  // draws weight, sizes, asymmetry, roughness

  double Weight() const { return weight_; }  // times the tissue of a person of mean weight

  // What lies over this bone, mm, where smooth_mm > 0 lie over the smooth bone, both along the ray
  // of the unit direction from the rays' centre. Above 2 mm.
  double Thickness(const Vec3& direction, double smooth_mm) const;

 private:
  double Height(const Vec3& direction) const;  // of all bumps, outward

  double weight_;
  std::vector<PhantomBump> bumps_;
  WaveSum roughness_;
};

// A field on a sphere of radius_mm, by direction, with about the covariance
// sd^2 exp(-distance / length), but for what is shorter than shortest_mm. All above 0.
struct RoughnessOptions {
  double sd, length_mm, shortest_mm, radius_mm;
};
WaveSum DrawRoughness(const RoughnessOptions& options, Random& random);

}  // namespace semblance
