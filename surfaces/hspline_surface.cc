// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surfaces/bspline_basis.h"
#include "surfaces/error.h"

namespace semblance {
namespace {

// Where a parameter falls along one direction of a level: the patch and the place in it.
struct Place {
  int patch;
  double t;
};

Place Locate(double x, int patches, Closure closure) {
  x = closure == Closure::kPeriodicU ? x - std::floor(x) : std::clamp(x, 0.0, 1.0);
  const int patch = std::min(static_cast<int>(x * patches), patches - 1);
  return {patch, x * patches - patch};
}

int WrapColumn(const HSplineShape& shape, int level, int i) {
  return shape.closure == Closure::kOpen ? i : (i + shape.Columns(level)) % shape.Columns(level);
}

double Power(double x, int order) { return order == 0 ? 1 : order == 1 ? x : x * x; }

void CheckLevel(const HSplineShape& shape, int level) {
  if (level < 0 || level > shape.max_level) {
    throw InputError(
        fmt::format("H-spline: there is no level {}; levels are 0..{}", level, shape.max_level));
  }
}

void CheckPlace(const HSplineShape& shape, int level, const Vec2& uv) {
  CheckLevel(shape, level);
  if (!uv.allFinite()) {
    throw InputError(fmt::format(
        "H-spline: (u,v) = ({}, {}) is not finite; the domain is [0,1] x [0,1]", uv.x(), uv.y()));
  }
}

ControlNet EmptyNet(const HSplineShape& shape, int level) {
  ControlNet net{shape.Columns(level), shape.Rows(level), {}};
  net.vertices.resize(static_cast<std::size_t>(net.columns) * net.rows, Vec3::Zero());
  return net;
}

void CheckShape(const HSplineShape& shape) {
  constexpr int kMostLevels = 8, kMostPatches = 8192;  // a side of the finest level
  const int least_u = shape.closure == Closure::kPeriodicU ? 4 : 1;
  if (shape.max_level < 0 || shape.max_level > kMostLevels) {
    throw InputError(fmt::format("H-spline: the finest level is {}; it must be in 0..{}",
                                 shape.max_level, kMostLevels));
  }
  const int most = kMostPatches >> shape.max_level;
  if (shape.patches_u < least_u || shape.patches_v < 1 || shape.patches_u > most ||
      shape.patches_v > most) {
    throw InputError(fmt::format(
        "H-spline: {} x {} patches are not allowed; with finest level {}, use {}..{} x 1..{}",
        shape.patches_u, shape.patches_v, shape.max_level, least_u, most, most));
  }
}

void CheckNet(const HSplineShape& shape, int level, const ControlNet& net) {
  CheckLevel(shape, level);
  const std::size_t expected = static_cast<std::size_t>(shape.Columns(level)) * shape.Rows(level);
  if (net.columns != shape.Columns(level) || net.rows != shape.Rows(level) ||
      net.vertices.size() != expected) {
    throw InputError(fmt::format(
        "H-spline: a net of {} x {} ({} vertices) does not fit level {}; {} x {} are needed",
        net.columns, net.rows, net.vertices.size(), level, shape.Columns(level),
        shape.Rows(level)));
  }
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    if (!net.vertices[k].allFinite()) {
      throw InputError(fmt::format("H-spline: vertex ({}, {}) of level {} is not finite",
                                   k % net.columns, k / net.columns, level));
    }
  }
}

SurfaceFrame FrameOf(const HSplineShape& shape, int level, const ControlNet& net, const Vec2& uv) {
  SurfaceFrame frame;
  frame.point = StencilAt(shape, level, uv).Apply(net);
  frame.du = StencilAt(shape, level, uv, {1, 0}).Apply(net);
  frame.dv = StencilAt(shape, level, uv, {0, 1}).Apply(net);
  const Vec3 normal = frame.du.cross(frame.dv);
  // Parallel tangents, judged relative to the tangents' own size, and vanishing ones, judged by
  // what rounding leaves of differences of vertices.
  constexpr double kDegenerate = 1e-12, kRounding = 1e-15;
  const double noise =
      kRounding * frame.point.norm() * std::max(shape.PatchesU(level), shape.PatchesV(level));
  const double least = std::min(frame.du.norm(), frame.dv.norm());
  frame.regular = least > noise &&
                  normal.norm() > kDegenerate * (frame.du.squaredNorm() + frame.dv.squaredNorm());
  if (frame.regular) {
    const Vec3 n = normal.normalized(), t = frame.du.normalized();
    frame.axes << t, n.cross(t), n;
  }
  return frame;
}

void CheckOffset(const HSplineShape& shape, const VertexId& vertex, const Vec3& offset) {
  const bool level_ok = vertex.level >= 1 && vertex.level <= shape.max_level;
  if (!level_ok || vertex.i < 0 || vertex.i >= shape.Columns(vertex.level) || vertex.j < 0 ||
      vertex.j >= shape.Rows(vertex.level)) {
    throw InputError(fmt::format(
        "H-spline: there is no vertex ({}, {}) with an offset on level {}; levels are 1..{}",
        vertex.i, vertex.j, vertex.level, shape.max_level));
  }
  if (!offset.allFinite()) {
    throw InputError(
        fmt::format("H-spline: the offset of vertex ({}, {}) of level {} is not finite", vertex.i,
                    vertex.j, vertex.level));
  }
}

// r and F of thesis 4.1 for one vertex.
struct Reference {
  Vec3 origin;
  Mat3 axes;
};

Reference ReferenceOf(const HSplineShape& shape, const ControlNet& coarser,
                      const VertexId& vertex) {
  const Vec2 uv = ParameterOf(shape, vertex);
  const SurfaceFrame frame = FrameOf(shape, vertex.level - 1, coarser, uv);
  if (shape.reference == OffsetReference::kWorld) {
    return {frame.point, Mat3::Identity()};
  }
  if (!frame.regular) {
    throw InputError(
        fmt::format("H-spline: the surface of level {} has no frame at (u,v) = ({}, {}), its "
                    "tangents vanish or are parallel; move the vertices around it apart",
                    vertex.level - 1, uv.x(), uv.y()));
  }
  return {frame.point, frame.axes};
}

}  // namespace

Stencil StencilAt(const HSplineShape& shape, int level, const Vec2& uv, DerivativeOrder order) {
  CheckPlace(shape, level, uv);
  const Place u = Locate(uv.x(), shape.PatchesU(level), shape.closure);
  const Place v = Locate(uv.y(), shape.PatchesV(level), Closure::kOpen);
  const std::array<double, 4> wu = CubicWeights(u.t, order.u), wv = CubicWeights(v.t, order.v);
  const double scale =
      Power(shape.PatchesU(level), order.u) * Power(shape.PatchesV(level), order.v);
  Stencil stencil;
  for (int a = 0; a < 4; ++a) {
    const int column = WrapColumn(shape, level, u.patch + a);
    for (int b = 0; b < 4; ++b) {
      stencil.index[a + 4 * b] = column + shape.Columns(level) * (v.patch + b);
      stencil.weight[a + 4 * b] = scale * wu[a] * wv[b];
    }
  }
  return stencil;
}

Vec2 ParameterOf(const HSplineShape& shape, const VertexId& vertex) {
  const double u = (vertex.i - 1.0) / shape.PatchesU(vertex.level);
  const double v = (vertex.j - 1.0) / shape.PatchesV(vertex.level);
  const double u_in =
      shape.closure == Closure::kPeriodicU ? u - std::floor(u) : std::clamp(u, 0.0, 1.0);
  return {u_in, std::clamp(v, 0.0, 1.0)};
}

ControlNet Refine(const HSplineShape& shape, const ControlNet& net, int level) {
  ControlNet fine = EmptyNet(shape, level + 1);
  for (int j = 0; j < fine.rows; ++j) {
    const RefinementRow v = RefineRow(j);
    for (int i = 0; i < fine.columns; ++i) {
      const RefinementRow u = RefineRow(i);
      Vec3 sum = Vec3::Zero();
      for (int b = 0; b < 3; ++b) {
        for (int a = 0; a < 3; ++a) {
          sum +=
              u.weight[a] * v.weight[b] * net.At(WrapColumn(shape, level, u.index[a]), v.index[b]);
        }
      }
      fine.At(i, j) = sum;
    }
  }
  return fine;
}

HSplineSurface::HSplineSurface(const HSplineShape& shape, ControlNet level0) : shape_(shape) {
  CheckShape(shape);
  CheckNet(shape, 0, level0);
  nets_.resize(shape.max_level + 1);
  nets_[0] = std::move(level0);
  RebuildFrom(1);
}

Vec3 HSplineSurface::Point(const Vec2& uv) const { return Derivative(uv, {}); }

Vec3 HSplineSurface::Derivative(const Vec2& uv, DerivativeOrder order) const {
  return StencilAt(shape_.max_level, uv, order).Apply(nets_.back());
}

SecondDerivatives HSplineSurface::Second(const Vec2& uv) const {
  return {Derivative(uv, {2, 0}), Derivative(uv, {1, 1}), Derivative(uv, {0, 2})};
}

SurfaceFrame HSplineSurface::Frame(const Vec2& uv) const {
  return FrameOf(shape_, shape_.max_level, nets_.back(), uv);
}

void HSplineSurface::SetNet(int level, const ControlNet& net) {
  CheckNet(shape_, level, net);
  HSplineSurface next = *this;  // so that a failure leaves the surface as it was
  if (level == 0) {
    next.nets_[0] = net;
  } else {
    for (const auto& [vertex, offset] : OffsetsThatGive(level, net)) {
      next.offsets_[vertex] = offset;
    }
  }
  next.RebuildFrom(std::max(level, 1));
  *this = std::move(next);
}

std::map<VertexId, Vec3> HSplineSurface::OffsetsThatGive(int level, const ControlNet& net) const {
  std::map<VertexId, Vec3> edits;
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      if (net.At(i, j) != nets_[level].At(i, j)) {
        const Reference reference = ReferenceOf(shape_, nets_[level - 1], {level, i, j});
        edits[{level, i, j}] = reference.axes.transpose() * (net.At(i, j) - reference.origin);
      }
    }
  }
  return edits;
}

std::map<VertexId, Vec3> HSplineSurface::Offsets(int level) const {
  return {offsets_.lower_bound({level, 0, 0}), offsets_.lower_bound({level + 1, 0, 0})};
}

std::optional<Vec3> HSplineSurface::Offset(const VertexId& vertex) const {
  const auto found = offsets_.find(vertex);
  return found == offsets_.end() ? std::nullopt : std::optional(found->second);
}

void HSplineSurface::SetOffsets(const std::map<VertexId, std::optional<Vec3>>& offsets) {
  if (offsets.empty()) {
    return;
  }
  HSplineSurface next = *this;  // so that a failure leaves the surface as it was
  for (const auto& [vertex, offset] : offsets) {
    CheckOffset(shape_, vertex, offset.value_or(Vec3::Zero()));
    next.offsets_.erase(vertex);
    if (offset) {
      next.offsets_.emplace(vertex, *offset);
    }
  }
  next.RebuildFrom(offsets.begin()->first.level);
  *this = std::move(next);
}

void HSplineSurface::RebuildFrom(int level) {
  for (int l = level; l <= shape_.max_level; ++l) {
    const ControlNet& coarser = nets_[l - 1];
    ControlNet net = Refine(shape_, coarser, l - 1);
    for (auto it = offsets_.lower_bound({l, 0, 0}); it != offsets_.end() && it->first.level == l;
         ++it) {
      const Reference reference = ReferenceOf(shape_, coarser, it->first);
      net.At(it->first.i, it->first.j) = reference.origin + reference.axes * it->second;
    }
    nets_[l] = std::move(net);
  }
}

}  // namespace semblance
