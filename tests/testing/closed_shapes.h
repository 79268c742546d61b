// SPDX-License-Identifier: GPL-3.0-or-later
// Smooth closed surfaces without handles that rays from no centre meet once each, by formula.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "surfaces/base/random.h"
#include "surfaces/hspline/hspline_surface.h"
#include "surfaces/marching/polygonize.h"
#include "surfaces/mesh/skull_fill.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::testing {

// A bump of the field that a surface is a level of: height exp(-|(x - centre) / width|^2).
struct FieldBump {
  Vec3 centre = Vec3::Zero();
  Vec3 width = Vec3::Ones();
  double height = 1;
};

// The places where the bumps' sum is 1; more inside. About two units wide.
struct ClosedShape {
  std::string name;
  std::vector<FieldBump> bumps;

  double Field(const Vec3& x) const {
    double sum = -1;
    for (const FieldBump& bump : bumps) {
      sum += bump.height * std::exp(-(x - bump.centre).cwiseQuotient(bump.width).squaredNorm());
    }
    return sum;
  }
  Vec3 Gradient(const Vec3& x) const {
    Vec3 sum = Vec3::Zero();
    for (const FieldBump& bump : bumps) {
      const Vec3 off = (x - bump.centre).cwiseQuotient(bump.width);
      sum -= 2 * bump.height * std::exp(-off.squaredNorm()) * off.cwiseQuotient(bump.width);
    }
    return sum;
  }
  // Of the surface, by Newton's method along the gradient; for x near it.
  Vec3 FootOf(Vec3 x) const {
    for (int round = 0; round < 8; ++round) {
      const Vec3 gradient = Gradient(x);
      x -= Field(x) / gradient.squaredNorm() * gradient;
    }
    return x;
  }
};

// A tube that thins towards both ends, bent by 230 degrees.
inline ClosedShape Bean() {
  ClosedShape shape{.name = "bean", .bumps = {}};
  for (int k = 0; k < 24; ++k) {
    const double along = (k + 0.5) / 24 * 2 - 1, angle = 2 * along;
    shape.bumps.push_back({.centre = 0.7 * Vec3(std::cos(angle), std::sin(angle), 0),
                           .width = Vec3::Constant(0.32),
                           .height = 0.75 - 0.25 * along * along});
  }
  return shape;
}

// A ball with four arms that bend back over it.
inline ClosedShape BallWithFingers() {
  ClosedShape shape{.name = "fingers", .bumps = {{.width = Vec3::Constant(0.55), .height = 2.0}}};
  for (int finger = 0; finger < 4; ++finger) {
    const double turn = std::numbers::pi / 2 * finger;
    const Vec3 out(std::cos(turn), std::sin(turn), finger % 2 == 0 ? 0.3 : -0.3),
        aside(-std::sin(turn), std::cos(turn), 0);
    for (int k = 0; k < 16; ++k) {
      const double angle = 2.6 * k / 15;
      shape.bumps.push_back(
          {.centre = 0.4 * out + 0.5 * std::sin(angle) * out + 0.35 * (1 - std::cos(angle)) * aside,
           .width = Vec3::Constant(0.14),
           .height = 0.75});
    }
  }
  return shape;
}

// A ball with a hollow that is wider than its mouth.
inline ClosedShape DentedBall() {
  ClosedShape shape{.name = "dented", .bumps = {{.width = Vec3::Constant(0.9), .height = 3.0}}};
  shape.bumps.push_back(
      {.centre = Vec3(0.05, 0, 0.1), .width = Vec3(0.36, 0.36, 0.2), .height = -4.0});
  for (int k = 0; k < 6; ++k) {
    shape.bumps.push_back({.centre = Vec3(0, 0, 0.4 + 0.1 * k),
                           .width = Vec3::Constant(0.16),
                           .height = -1.2 + 0.15 * k});
  }
  return shape;
}

// Thin flat ears on an ellipsoid.
inline ClosedShape EllipsoidWithEars() {
  ClosedShape shape{.name = "ears", .bumps = {{.width = Vec3(0.5, 0.75, 0.6), .height = 2.5}}};
  for (const double side : {-1.0, 1.0}) {
    for (int k = 0; k < 9; ++k) {
      const double out = k / 8.0;
      shape.bumps.push_back({.centre = Vec3(side * (0.45 + 0.55 * out), -0.35 * out * out, 0.2),
                             .width = Vec3(0.12, 0.1, 0.2 + 0.15 * out),
                             .height = 0.8});
    }
  }
  return shape;
}

// About so many points on the surface with even triangles between them, each off by `noise` in each
// coordinate.
inline TriMesh MeshOf(const ClosedShape& shape, double count, double noise) {
  constexpr int kCells = 60;
  constexpr double kReach = 1.8013;  // no corner of the grid lies on the surface
  const SampleGrid grid{.origin = Vec3::Constant(-kReach),
                        .cell_mm = Vec3::Constant(2 * kReach / kCells),
                        .counts = {kCells + 1, kCells + 1, kCells + 1}};
  const TriMesh cubes =
      PolygonizeAll([&](const Vec3& x) { return shape.Field(x); }, grid, {}, {}).mesh;
  TriMesh mesh = Remesh(cubes, std::sqrt(2 / std::numbers::sqrt3 * Area(cubes) / count));
  Random random(11);
  for (Vec3& p : mesh.points) {
    const Vec3 off(random.Normal(), random.Normal(), random.Normal());
    p = shape.FootOf(p) + noise * off;
  }
  return mesh;
}

// Largest and root mean square distance of the places from v = first to last from the shape, as
// areas weigh them.
struct ShapeErrors {
  double rms = 0, largest = 0;
};
inline ShapeErrors ErrorsOf(const HSplineSurface& surface, const ClosedShape& shape, double first,
                            double last) {
  constexpr int kRings = 150, kAround = 300;
  double squares = 0, areas = 0;
  ShapeErrors errors;
  for (int j = 0; j < kRings; ++j) {
    const double v = first + (last - first) * (j + 0.5) / kRings;
    for (int i = 0; i < kAround; ++i) {
      const Vec2 uv((i + 0.5) / kAround, v);
      const Vec3 p = surface.Point(uv), along = surface.Point(uv + Vec2(0.5 / kAround, 0)) - p,
                 across = surface.Point(uv + Vec2(0, 0.5 * (last - first) / kRings)) - p;
      const double area = along.cross(across).norm(), off = (p - shape.FootOf(p)).norm();
      squares += area * off * off;
      areas += area;
      errors.largest = std::max(errors.largest, off);
    }
  }
  errors.rms = std::sqrt(squares / areas);
  return errors;
}

inline std::vector<ClosedShape> ClosedShapes() {
  return {Bean(), BallWithFingers(), DentedBall(), EllipsoidWithEars()};
}

}  // namespace semblance::testing
