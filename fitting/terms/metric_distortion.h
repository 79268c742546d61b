// SPDX-License-Identifier: GPL-3.0-or-later
// Strain of a surface against a template: the damage that a fit does to features (thesis 4.3).
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "surfaces/base/geometry.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// The k-th of the 2 x 2 Gauss points of each of columns x rows patches, k = 0 .. 4 columns rows
// - 1. The four points of a patch have consecutive numbers.
inline Vec2 GaussPoint(int k, int columns, int rows) {
  const double off = 0.5 / std::numbers::sqrt3;
  const int column = k / 4 % columns, row = k / 4 / columns;
  return {(column + 0.5 + (k % 2 == 0 ? -off : off)) / columns,
          (row + 0.5 + (k % 4 < 2 ? -off : off)) / rows};
}

// Maps the template's unit tangents to a surface: e1 lies along the template's du, e2 across it in
// the tangent plane. Their images are linear in the surface's derivatives: x1 = a1 du, x2 = a2 du +
// b2 dv.
struct TemplateAxes {
  // Returns nothing where the template's tangents vanish or are parallel.
  static std::optional<TemplateAxes> At(const Vec3& rest_du, const Vec3& rest_dv) {
    const double length = rest_du.norm(), area = rest_du.cross(rest_dv).norm();
    if (!(area > 1e-12 * (rest_du.squaredNorm() + rest_dv.squaredNorm()))) {
      return std::nullopt;
    }
    TemplateAxes axes;
    axes.a1 = 1 / length;
    axes.b2 = length / area;
    axes.a2 = -rest_du.dot(rest_dv) / (length * length) * axes.b2;
    axes.area = area;
    return axes;
  }

  double a1 = kNaN, a2 = kNaN, b2 = kNaN;  // 1/mm
  double area = kNaN;                      // template's area per unit of u x v, mm^2
};

// Green's strain in the template's axes, and the change of area. All are zero for an isometry.
struct Strain {
  double e11 = kNaN, e22 = kNaN, e12 = kNaN;
  double area = kNaN;  // surface's area / template's area - 1

  double SquaredNorm() const { return e11 * e11 + e22 * e22 + 2 * e12 * e12; }
};

inline Strain ComputeStrain(const TemplateAxes& axes, const Vec3& du, const Vec3& dv) {
  const Vec3 x1 = axes.a1 * du, x2 = axes.a2 * du + axes.b2 * dv;
  return {.e11 = (x1.squaredNorm() - 1) / 2,
          .e22 = (x2.squaredNorm() - 1) / 2,
          .e12 = x1.dot(x2) / 2,
          .area = x1.cross(x2).norm() - 1};
}

struct MetricDistortion {
  double rms_strain = kNaN;  // of |E|, Green's strain, weighted by the template's area
  double max_strain = kNaN;  // of |E|
  double rms_area = kNaN;    // of Strain::area
  double area_cm2 = 0;       // template's area over which the means are taken
};

// The distortion over the places where `wanted` accepts the point of the template `rest`. The
// places are the 2 x 2 Gauss points of each patch of the finest level at which the template has
// tangents. `surface` has the shape of `rest`. The result is NaN if there is no such place.
MetricDistortion MeasureDistortion(const HSplineSurface& surface, const HSplineSurface& rest,
                                   const std::function<bool(const Vec3&)>& wanted);

}  // namespace semblance::fitting
