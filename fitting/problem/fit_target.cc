// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/fit_target.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

bool InDomain(const Vec2& uv) { return (uv.array() >= 0).all() && (uv.array() <= 1).all(); }

bool IsPositive(double value) { return std::isfinite(value) && value > 0; }

void CheckSizes(const ScatteredPoints& p) {
  if (p.uv.size() != p.size() || (!p.weights.empty() && p.weights.size() != p.size())) {
    throw InputError(fmt::format(
        "fit target: {} points with {} pairs (u,v) and {} weights; give (u,v) for each point, and "
        "a weight for each or for none",
        p.size(), p.uv.size(), p.weights.size()));
  }
}

// label: the point's, or empty.
void CheckPoint(std::size_t index, std::string_view label, const Vec3& position, const Vec2& uv,
                double weight) {
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("fit target: point {} ('{}'): {}", index, label, what));
  };
  if (!position.allFinite()) {
    fail("its position is not finite; remove it or give three numbers in mm");
  }
  if (!InDomain(uv)) {
    fail(fmt::format("(u,v) = ({}, {}) is outside [0,1] x [0,1]", uv.x(), uv.y()));
  }
  if (!IsPositive(weight)) {
    fail(fmt::format("weight {} is not a positive number", weight));
  }
}

void CheckShapePoints(std::span<const ShapePoint> shape) {
  for (std::size_t i = 0; i < shape.size(); ++i) {
    const ShapePoint& p = shape[i];
    if (!p.position.allFinite() || !InDomain(p.uv) || !IsPositive(p.sd_mm) ||
        !IsPositive(p.share)) {
      throw InputError(
          fmt::format("fit target: point {} of the prior's shape: (u,v) = ({}, {}), sd_mm {}, "
                      "share {}; give a finite position, (u,v) in [0,1] x [0,1], and sd_mm and "
                      "share above 0",
                      i, p.uv.x(), p.uv.y(), p.sd_mm, p.share));
    }
  }
}

}  // namespace

FitTarget MakeFitTarget(std::span<const Vec3> positions, std::span<const Vec2> uv,
                        std::span<const double> weights) {
  CheckSizes({positions, uv, weights});
  FitTarget target;
  target.points.reserve(positions.size());
  for (std::size_t k = 0; k < positions.size(); ++k) {
    target.points.push_back({.label = {},
                             .position = positions[k],
                             .uv = uv[k],
                             .weight = weights.empty() ? 1 : weights[k]});
  }
  return target;
}

void CheckTarget(const FitTarget& target) {
  if (!target.anchors.empty() && target.anchors.size() != target.points.size()) {
    throw InputError(fmt::format("fit target: {} anchors on bone for {} points; give one per point",
                                 target.anchors.size(), target.points.size()));
  }
  for (std::size_t i = 0; i < target.points.size(); ++i) {
    const FitPoint& p = target.points[i];
    CheckPoint(i, p.label, p.position, p.uv, p.weight);
    if (!target.anchors.empty() && target.anchors[i].foot.allFinite() &&
        !(std::abs(target.anchors[i].direction.norm() - 1) < 1e-6)) {
      throw InputError(fmt::format(
          "fit target: point {} ('{}'): its direction out of the bone has the length {}; give a "
          "unit vector",
          i, p.label, target.anchors[i].direction.norm()));
    }
  }
  CheckShapePoints(target.shape);
}

void CheckPoints(const ScatteredPoints& points) {
  CheckSizes(points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    CheckPoint(k, "", points.positions[k], points.uv[k], points.Weight(k));
  }
}

}  // namespace semblance::fitting
