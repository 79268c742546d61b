// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/hspline_shape.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/hspline/bspline.h"

namespace semblance::surfaces {
namespace {

// The index of the patch along one direction, and the coordinate within it, 0..1.
std::pair<int, double> PatchAlong(double x, int patches, bool closed) {
  x = IntoUnit(x, closed);
  const int patch = std::min(static_cast<int>(x * patches), patches - 1);
  return {patch, x * patches - patch};
}

double Power(double x, int order) { return order == 0 ? 1 : order == 1 ? x : x * x; }

}  // namespace

void CheckShape(const HSplineShape& shape) {
  constexpr int kMaxLevels = 8;
  const int least_u = shape.ClosedU() ? 4 : 1;
  if (shape.max_level < 0 || shape.max_level > kMaxLevels) {
    throw InputError(fmt::format("H-spline: the finest level is {}; it must be in 0..{}",
                                 shape.max_level, kMaxLevels));
  }
  const int most = kMaxPatches >> shape.max_level;
  if (shape.patches_u < least_u || shape.patches_v < 1 || shape.patches_u > most ||
      shape.patches_v > most) {
    throw InputError(fmt::format(
        "H-spline: {} x {} patches are not allowed; with finest level {}, use {}..{} x 1..{}",
        shape.patches_u, shape.patches_v, shape.max_level, least_u, most, most));
  }
}

void CheckParameter(const HSplineShape& shape, int level, const Vec2& uv) {
  if (level < 0 || level > shape.max_level) {
    throw InputError(
        fmt::format("H-spline: there is no level {}; levels are 0..{}", level, shape.max_level));
  }
  if (!uv.allFinite()) {
    throw InputError(fmt::format(
        "H-spline: (u,v) = ({}, {}) is not finite; the domain is [0,1] x [0,1]", uv.x(), uv.y()));
  }
}

PatchPoint PatchPointAt(const HSplineShape& shape, int level, const Vec2& uv) {
  const auto [i, s] = PatchAlong(uv.x(), shape.PatchesU(level), shape.ClosedU());
  const auto [j, t] = PatchAlong(uv.y(), shape.PatchesV(level), false);
  return {{level, i, j}, s, t};
}

std::array<double, 16> PatchWeights(const HSplineShape& shape, const PatchPoint& at,
                                    DerivativeOrder order) {
  const std::array<double, 4> wu = CubicWeights(at.s, order.u), wv = CubicWeights(at.t, order.v);
  const int level = at.patch.level;
  const double scale =
      Power(shape.PatchesU(level), order.u) * Power(shape.PatchesV(level), order.v);
  std::array<double, 16> weights;
  for (int k = 0; k < 16; ++k) {
    weights[k] = scale * wu[k % 4] * wv[k / 4];
  }
  return weights;
}

Stencil StencilAt(const HSplineShape& shape, int level, const Vec2& uv, DerivativeOrder order) {
  CheckParameter(shape, level, uv);
  const PatchPoint at = PatchPointAt(shape, level, uv);
  Stencil stencil;
  for (int k = 0; k < 16; ++k) {
    stencil.index[k] =
        shape.Column(level, at.patch.i + k % 4) + shape.Columns(level) * (at.patch.j + k / 4);
  }
  stencil.weight = PatchWeights(shape, at, order);
  return stencil;
}

Vec2 GrevillePoint(const HSplineShape& shape, const VertexId& vertex) {
  const double u = (vertex.i - 1.0) / shape.PatchesU(vertex.level);
  const double v = (vertex.j - 1.0) / shape.PatchesV(vertex.level);
  return {IntoUnit(u, shape.ClosedU()), std::clamp(v, 0.0, 1.0)};
}

ControlNet Refine(const HSplineShape& shape, const ControlNet& net, int level) {
  ControlNet fine{shape.Columns(level + 1), shape.Rows(level + 1), {}};
  fine.vertices.reserve(static_cast<std::size_t>(fine.columns) * fine.rows);
  for (int j = 0; j < fine.rows; ++j) {
    const RefinementRow v = RefineRow(j);
    for (int i = 0; i < fine.columns; ++i) {
      const RefinementRow u = RefineRow(i);
      fine.vertices.push_back(RefinedVertex(u, v, [&](int a, int b) -> const Vec3& {
        return net.At(shape.Column(level, u.index[a]), v.index[b]);
      }));
    }
  }
  return fine;
}

std::array<Vec3, 16> RefinePatch(const std::array<Vec3, 16>& vertices, int right, int upper) {
  std::array<Vec3, 16> fine;
  for (int k = 0; k < 16; ++k) {
    const RefinementRow u = RefineRow(right + k % 4), v = RefineRow(upper + k / 4);
    fine[k] = RefinedVertex(
        u, v, [&](int a, int b) -> const Vec3& { return vertices[u.index[a] + 4 * v.index[b]]; });
  }
  return fine;
}

}  // namespace semblance::surfaces
