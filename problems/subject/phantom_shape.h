// SPDX-License-Identifier: GPL-3.0-or-later
// The bone of a phantom by formula, without any person's data. The smooth bone is a radius for
// every direction. The relief adds, under a skin that stays smooth, hollows that muscle and fat
// fill, prominences that they cover thinly, a person's weight, and roughness.
#pragma once

#include <span>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/random.h"

namespace semblance::problems {

// The common start of all rays, in mm, before the surface is moved to put nasion at the origin.
inline const Vec3 kPhantomCentre(0, 75, -20);

// The unit direction from the centre to a point in the frame of an average skull, in mm.
Vec3 PhantomDirection(const Vec3& toward);

// A smooth function of direction. As DrawWaves draws it, its rms is about 0.7 and it stays within
// 2.3.
struct WaveSum {
  struct Wave {
    Vec3 wave_number;
    double phase, amplitude;
  };
  std::vector<Wave> waves;

  double Value(const Vec3& direction) const;
  Vec3 Gradient(const Vec3& direction) const;
};
WaveSum DrawWaves(Random& random);

// A bump, or with a negative height a hollow, of an average skull.
struct BumpOnSkull {
  Vec3 on_skull;  // mm; the left one of a pair
  Vec3 sigma_mm;  // width along x, y, z
  double height_mm;
  double steepness = 1;  // 1: a bell; 2: a flat floor with a rim
};

// The bump of one phantom, as a function of the direction from the centre.
struct PhantomBump {
  Vec3 direction, sigma;
  double height_mm, steepness;

  double Value(const Vec3& at) const;   // height exp(-q^steepness), mm; q as below
  Vec3 Gradient(const Vec3& at) const;  // derivative with respect to the direction

 private:
  double SquaredDistance(const Vec3& at) const;  // q = |(at - direction) / sigma|^2 / 2
};

// Relative differences of heights: between phantoms, and between the two sides of a pair.
struct BumpSpread {
  double height, side;
};
// Draws the bumps of one phantom. A bump outside the mid-plane gives a pair.
std::vector<PhantomBump> DrawBumps(std::span<const BumpOnSkull> bumps, const BumpSpread& spread,
                                   Random& random);

// The smooth bone: a closed surface that every ray from the centre meets once.
class PhantomShape {
 public:
  explicit PhantomShape(Random& random);  // draws sizes, heights of features and asymmetry

  double Radius(const Vec3& direction) const;  // from the centre, mm; direction unit
  Vec3 Normal(const Vec3& direction) const;    // exact unit normal of the surface, outward

 private:
  struct Ellipsoid {
    Vec3 offset;   // from the rays' centre to its own centre, mm
    Mat3 quadric;  // x . quadric x = 1 on the surface, with x from its own centre
  };
  struct Radial {
    double radius_mm;
    Vec3 gradient;  // with respect to the direction, along the unit sphere
  };
  static Radial FarHit(const Ellipsoid& e, const Vec3& direction);
  Radial JoinedBodies(const Vec3& direction) const;
  Radial At(const Vec3& direction) const;

  std::vector<Ellipsoid> bodies_;
  std::vector<PhantomBump> bumps_;
  WaveSum waves_;
};

// The relief of a phantom's bone: it changes the tissue between the smooth skin and the bone.
class PhantomRelief {
 public:
  explicit PhantomRelief(Random& random);  // draws weight, sizes, asymmetry and roughness

  double Weight() const { return weight_; }  // factor of tissue; 1 for a person of mean weight

  // The tissue over this bone, in mm, where smooth_mm > 0 of tissue lie over the smooth bone. Both
  // are measured along the ray of the unit direction from the rays' centre. Always above 2 mm.
  double Thickness(const Vec3& direction, double smooth_mm) const;

 private:
  double Height(const Vec3& direction) const;  // sum of all bumps, outward, mm

  double weight_;
  std::vector<PhantomBump> bumps_;
  WaveSum roughness_;
};

// A random field on a sphere of radius_mm, as a function of direction, with about the covariance
// sd^2 exp(-distance / length). It has no wavelength below shortest_mm. All options must be above
// 0.
struct RoughnessOptions {
  double sd, length_mm, shortest_mm, radius_mm;
};
WaveSum DrawRoughness(const RoughnessOptions& options, Random& random);

}  // namespace semblance::problems
