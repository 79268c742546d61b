// SPDX-License-Identifier: GPL-3.0-or-later
// The bone of a phantom by formula: a radius for every direction, no one's data.
#pragma once

#include <span>
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

// A bump or a hollow of an average skull.
struct BumpOnSkull {
  Vec3 on_skull;  // mm; the left one of a pair
  Vec3 sigma_mm;  // width along x, y, z
  double height_mm;
  double steepness = 1;  // 1: a bell; 2: a floor with a rim
};

// The same as one phantom has it, seen from the rays' centre.
struct PhantomBump {
  Vec3 direction, sigma;
  double height_mm, steepness;

  double Value(const Vec3& at) const;   // height exp(-q^steepness), mm; q as below
  Vec3 Gradient(const Vec3& at) const;  // by the direction

 private:
  double Away(const Vec3& at) const;  // q = |(at - direction) / sigma|^2 / 2
};

// By what share heights differ between phantoms, and the sides of a pair from one another.
struct BumpSpread {
  double height, side;
};
// Both of each pair, which is what does not lie in the mid-plane.
std::vector<PhantomBump> DrawBumps(std::span<const BumpOnSkull> bumps, const BumpSpread& spread,
                                   Random& random);

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
  struct Radial {
    double radius_mm;
    Vec3 gradient;  // by the direction, along the unit sphere
  };
  static Radial Hit(const Ellipsoid& e, const Vec3& direction);
  Radial Bodies(const Vec3& direction) const;
  Radial At(const Vec3& direction) const;

  std::vector<Ellipsoid> bodies_;
  std::vector<PhantomBump> bumps_;
  WaveSum waves_;
};

}  // namespace semblance
