// SPDX-License-Identifier: GPL-3.0-or-later
// What a surface is fitted to: points, each with the (u,v) at which the surface should meet it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/point_role.h"

namespace semblance {

struct FitPoint {
  std::string label;                     // site of a dowel, or patch of a seed; for reports
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  double weight = 1;                     // > 0; relative to the other points
  PointRole role = PointRole::kScattered;
};

// Where a point stands on bone, for the terms that look at bone.
struct BoneAnchor {
  Vec3 foot = Vec3::Constant(kNaN);       // mm; NaN where it is not known
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
};

// What a prior holds for likely, for PriorShapeTerm: at uv the surface lies at `position`, give or
// take sd_mm in each direction.
struct ShapePoint {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double sd_mm = kNaN;                   // > 0
  double share = 1;                      // > 0: of the surface that it stands for, relative
};

// What the surface must meet whatever else it does.
struct ExactPoint {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 normal = Vec3::Zero();            // of any length: it is across the tangents; or zero
};

// More are refused: their equations are solved as one dense system.
inline constexpr std::size_t kMostExactPoints = 500;

struct FitTarget {
  std::vector<FitPoint> points;
  std::vector<BoneAnchor> anchors = {};  // one per point, or none
  std::vector<ShapePoint> shape = {};    // where there is a prior
  std::vector<ExactPoint> exact = {};    // plans adaptive and auto, solver fastest
};

// Scattered points as columns; what they refer to must outlive them.
struct ScatteredPoints {
  std::span<const Vec3> positions;       // mm
  std::span<const Vec2> uv;              // in [0,1] x [0,1], one per point
  std::span<const double> weights = {};  // > 0, one per point; or none: all 1

  std::size_t size() const { return positions.size(); }
  double Weight(std::size_t k) const { return weights.empty() ? 1 : weights[k]; }
};

// Scattered points, without labels. weights: one per point, or none for equal ones. Throws
// InputError if the sizes differ.
FitTarget TargetOf(std::span<const Vec3> positions, std::span<const Vec2> uv,
                   std::span<const double> weights = {});

// Throws InputError, naming the point, if one has a position that is not finite, a (u,v) outside
// the domain, a weight that is not positive and finite, or a foot without a unit direction; if
// there are anchors, but not one per point; or for a point of the shape that is not finite, outside
// the domain, or without a positive sd_mm and share.
void CheckTarget(const FitTarget& target);
// The same, and if the numbers of positions, (u,v) and weights differ.
void CheckPoints(const ScatteredPoints& points);

}  // namespace semblance
