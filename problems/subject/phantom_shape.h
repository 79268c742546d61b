// SPDX-License-Identifier: GPL-3.0-or-later
// The bone of a phantom by formula: a radius for every direction, no one's data.
#pragma once

#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance {

// Where the rays start, mm, before the surface is moved to put nasion at the origin.
inline const Vec3 kPhantomCentre(0, 75, -20);

// The direction from the centre to a point given in the frame of an average skull, mm.
Vec3 PhantomDirection(const Vec3& toward);

struct WaveSum {  // a smooth function of direction; as drawn, rms about 0.7, never beyond 2.3
  struct Wave {
    Vec3 wave_number;
    double phase, amplitude;
  };
  std::vector<Wave> waves;

  double Value(const Vec3& direction) const;
  Vec3 Gradient(const Vec3& direction) const;
};
WaveSum DrawWaves(Random& random);

// A closed smooth surface that every ray from the centre meets once.
class PhantomShape {
 public:
  explicit PhantomShape(Random& random);  // draws sizes, heights of features, asymmetry

  double Radius(const Vec3& direction) const;  // from the centre, mm; direction unit
  Vec3 Normal(const Vec3& direction) const;    // of the surface there, unit, outward; exact

 private:
  struct Ellipsoid {
    Vec3 offset;   // of its middle from the rays' centre, mm
    Mat3 quadric;  // x . quadric x = 1 on the surface, x from its middle
  };
  struct Bump {  // height * exp(-|(d - direction) / sigma|^2 / 2)
    Vec3 direction, sigma;
    double height_mm;
  };
  struct Radial {
    double radius_mm;
    Vec3 gradient;  // by the direction, along the unit sphere
  };
  static Radial Hit(const Ellipsoid& e, const Vec3& direction);
  Radial Bodies(const Vec3& direction) const;
  Radial At(const Vec3& direction) const;

  std::vector<Ellipsoid> bodies_;
  std::vector<Bump> bumps_;
  WaveSum waves_;
};

}  // namespace semblance
