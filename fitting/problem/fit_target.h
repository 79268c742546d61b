// SPDX-License-Identifier: GPL-3.0-or-later
// The target of a fit: points, each with the (u,v) at which the surface should meet it.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/base/point_role.h"

namespace semblance::fitting {

struct FitPoint {
  std::string label;                     // dowel's site or seed's patch; for reports
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  double weight = 1;                     // > 0; relative to the other points
  PointRole role = PointRole::kScattered;
};

// A point's foot on the bone, for the terms that use bone.
struct BoneAnchor {
  Vec3 foot = Vec3::Constant(kNaN);       // mm; NaN if it is unknown
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
};

// A place that a prior predicts, for PriorShapeTerm: at uv the surface lies at `position`, with
// standard deviation sd_mm along each axis.
struct ShapePoint {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double sd_mm = kNaN;                   // > 0
  double share = 1;                      // > 0; relative area that the point represents
};

// A place that the surface must meet exactly.
struct ExactPoint {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 normal = Vec3::Zero();            // any length; zero: the normal is free
};

// Most exact points of a fit. Their equations are solved as one dense system, which takes cubic
// time.
inline constexpr std::size_t kMaxExactPoints = 500;

struct FitTarget {
  std::vector<FitPoint> points;
  std::vector<BoneAnchor> anchors = {};  // one per point, or none
  std::vector<ShapePoint> shape = {};    // of a prior, or empty
  std::vector<ExactPoint> exact = {};    // plans adaptive and auto, solver fastest
};

// Scattered points as columns. The referenced arrays must outlive it.
struct ScatteredPoints {
  std::span<const Vec3> positions;       // mm
  std::span<const Vec2> uv;              // in [0,1] x [0,1], one per point
  std::span<const double> weights = {};  // > 0, one per point; empty: all 1

  std::size_t size() const { return positions.size(); }
  double Weight(std::size_t k) const { return weights.empty() ? 1 : weights[k]; }
};

// Makes a target of scattered points without labels. weights: one per point, or empty for equal
// weights. Throws InputError if the sizes differ.
FitTarget MakeFitTarget(std::span<const Vec3> positions, std::span<const Vec2> uv,
                        std::span<const double> weights = {});

// Throws InputError that names the point if a point has a position that is not finite, a (u,v)
// outside the domain, a weight that is not positive and finite, or a foot without a unit direction;
// if the number of anchors is neither 0 nor that of the points; or if a point of the prior's shape
// is not finite, lies outside the domain, or lacks a positive sd_mm and share.
void CheckTarget(const FitTarget& target);
// Checks positions, (u,v) and weights like CheckTarget, and that their numbers agree.
void CheckPoints(const ScatteredPoints& points);

}  // namespace semblance::fitting
