// SPDX-License-Identifier: GPL-3.0-or-later
// Maps of scattered points to planes and cylinders.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::fitting {

// An axis with two directions across it; the three are orthonormal and right-handed.
struct CylinderAxis {
  Vec3 direction = Vec3::Constant(kNaN), across = Vec3::Constant(kNaN),
       third = Vec3::Constant(kNaN);
  Vec3 centre = Vec3::Constant(kNaN);  // a point of the axis, mm

  double DistanceTo(const Vec3& p) const;
};

// A map of the points to the plane, before it is brought to [0,1] x [0,1].
struct PointMap {
  std::string how = {};         // in words
  std::vector<Vec2> at = {};    // one per point: mm, or around a cylinder turns (0..1) and mm
  Vec2 unit_mm = Vec2::Ones();  // length of a unit of `at`
  bool goes_round = false;      // in u
  CylinderAxis axis = {};       // of a cylinder
  Vec3 normal = Vec3::Zero();   // of a plane, unit

  std::vector<Vec2> InMm() const;
  double Period_mm() const { return goes_round ? unit_mm.x() : 0; }
};

// Maps in the order of preference. `make` builds one of them, so that no map is built that is not
// looked at.
struct MapChoice {
  int count = 0;
  std::function<PointMap(int)> make;
};

// The plane across `normal`, or for a zero normal the plane of least squares and those across z, y
// and x. Throws InputError for a normal that is not finite; `make` throws it for points on a line.
//   points: referred to by `make`.
MapChoice PlanesOver(std::span<const Vec3> points, const Vec3& normal);

// The cylinder along `axis`, or for a zero axis those along the three principal axes of the points,
// the one with the most even distances first. The axis goes through the centre of the circle of
// least squares (Kasa) through the points as seen along it.
//   points: referred to by `make`.
MapChoice CylindersAround(std::span<const Vec3> points, const Vec3& axis);

// The direction to which the points' surface is most nearly parallel everywhere, as a bent sheet is
// to the axis round which it is bent: across the normals of the planes of least squares through
// some hundred points and their neighbours. Unit.
Vec3 DirectionAcrossNormals(std::span<const Vec3> points);

// A cylinder's map, cut open along the middle of the widest sector without points and rolled out:
// angles become lengths at the points' mean distance from the axis. Nothing if no sector is wide
// enough: 20 degrees, twice as wide as any other, and far wider than chance leaves between that
// many points.
std::optional<PointMap> CutOpen(PointMap cylinder);

// Distances of the points from the axis of their cylinder.
struct CylinderEnds {
  double narrower_mm = kNaN;  // median of the hundredth of the points at the narrower end
  double all_mm = kNaN;       // median of all points

  // Returns whether the points close at an end, as a ball does. They then have no angle there,
  // although they fold over the cylinder as little as a tube.
  bool Close() const;
};
CylinderEnds FindEnds(std::span<const Vec3> points, const CylinderAxis& axis);

}  // namespace semblance::fitting
