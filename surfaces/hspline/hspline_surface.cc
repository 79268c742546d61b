// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline/hspline_surface.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/hspline/sparse_net.h"

namespace semblance::surfaces {
namespace {

void CheckNet(const HSplineShape& shape, int level, const ControlNet& net) {
  CheckParameter(shape, level, Vec2::Zero());
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

// Fills `regular` and, if the tangents span a plane, `axes`.
void OrientFrame(const HSplineShape& shape, int level, SurfaceFrame& frame) {
  const Vec3 normal = frame.du.cross(frame.dv);
  // Tangents are parallel relative to their own length (kDegenerate). They vanish if they are no
  // longer than the round-off in differences of vertices (kRounding).
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

// r and F of x = r + F o for one vertex.
struct Reference {
  Vec3 origin;
  Mat3 axes;
};

Reference FindReference(const HSplineSurface& surface, const VertexId& vertex) {
  const Vec2 uv = surface.GrevillePoint(vertex);
  const SurfaceFrame frame = surface.LevelFrame(vertex.level - 1, uv);
  if (surface.shape().reference == OffsetReference::kWorld) {
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

Vec3 Sum(const std::array<double, 16>& weights, const std::array<const Vec3*, 4>& columns) {
  Vec3 sum = Vec3::Zero();
  for (int k = 0; k < 16; ++k) {
    sum += weights[k] * columns[k % 4][k / 4];
  }
  return sum;
}

}  // namespace

HSplineSurface::HSplineSurface(const HSplineShape& shape, const ControlNet& level0)
    : shape_(shape) {
  CheckShape(shape);
  CheckNet(shape, 0, level0);
  levels_.resize(shape.max_level + 1);
  levels_[0] = {RowTable(MakeLayouts(shape, {})[0].influenced, shape.patches_v),
                SparseNet::WholeNet(level0, StoredRows(shape, 0))};
}

PatchPoint HSplineSurface::FinestPatch(int level, const Vec2& uv) const {
  CheckParameter(shape_, level, uv);
  for (;; --level) {
    const PatchPoint at = PatchPointAt(shape_, level, uv);
    if (levels_[level].influenced.Find(at.patch.i, at.patch.j) >= 0) {
      return at;  // level 0 holds all patches
    }
  }
}

HSplineSurface::Columns4 HSplineSurface::StoredColumns(const PatchId& patch) const {
  Columns4 columns;
  for (int a = 0; a < 4; ++a) {
    columns[a] = levels_[patch.level].net.Find(shape_.Column(patch.level, patch.i + a), patch.j, 4);
  }
  return columns;
}

Vec3 HSplineSurface::LevelDerivative(int level, const Vec2& uv, DerivativeOrder order) const {
  const PatchPoint at = FinestPatch(level, uv);
  return Sum(PatchWeights(shape_, at, order), StoredColumns(at.patch));
}

SecondDerivatives HSplineSurface::Second(const Vec2& uv) const {
  const PatchPoint at = FinestPatch(shape_.max_level, uv);
  const Columns4 columns = StoredColumns(at.patch);
  const auto derivative = [&](DerivativeOrder order) {
    return Sum(PatchWeights(shape_, at, order), columns);
  };
  return {derivative({2, 0}), derivative({1, 1}), derivative({0, 2})};
}

SurfaceFrame HSplineSurface::LevelFrame(int level, const Vec2& uv) const {
  const PatchPoint at = FinestPatch(level, uv);
  const Columns4 columns = StoredColumns(at.patch);
  SurfaceFrame frame;
  frame.point = Sum(PatchWeights(shape_, at), columns);
  frame.du = Sum(PatchWeights(shape_, at, {1, 0}), columns);
  frame.dv = Sum(PatchWeights(shape_, at, {0, 1}), columns);
  OrientFrame(shape_, at.patch.level, frame);
  return frame;
}

ControlNet HSplineSurface::Net(int level) const {
  CheckParameter(shape_, level, Vec2::Zero());
  int l = level;  // the finest level with all vertices stored
  while (levels_[l].net.size() < static_cast<std::size_t>(Columns(l)) * StoredRows(shape_, l)) {
    --l;
  }
  ControlNet net{Columns(l), Rows(l), {}};
  net.vertices.resize(static_cast<std::size_t>(net.columns) * net.rows);
  levels_[l].net.CopyTo(net);
  for (; l < level; ++l) {
    net = Refine(shape_, net, l);
    levels_[l + 1].net.CopyTo(net);
  }
  return net;
}

std::array<Vec3, 16> HSplineSurface::PatchVertices(const PatchId& patch) const {
  const Columns4 columns = StoredColumns(patch);
  if (std::find(columns.begin(), columns.end(), nullptr) != columns.end()) {
    return RefinePatch(PatchVertices({patch.level - 1, patch.i / 2, patch.j / 2}), patch.i % 2,
                       patch.j % 2);
  }
  std::array<Vec3, 16> vertices;
  for (int k = 0; k < 16; ++k) {
    vertices[k] = columns[k % 4][k / 4];
  }
  return vertices;
}

void HSplineSurface::SetNet(int level, const ControlNet& net) {
  CheckNet(shape_, level, net);
  HSplineSurface next = *this;  // so that a failure leaves this surface unchanged
  if (level == 0) {
    next.levels_[0].net = SparseNet::WholeNet(net, StoredRows(shape_, 0));
  } else {
    for (const auto& [vertex, offset] : OffsetsForNet(level, net)) {
      next.offsets_[vertex] = offset;
    }
  }
  next.RebuildFrom(std::max(level, 1));
  *this = std::move(next);
}

std::map<VertexId, Vec3> HSplineSurface::OffsetsForNet(int level, const ControlNet& net) const {
  const ControlNet present = Net(level);
  std::map<VertexId, Vec3> edits;
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      if (net.At(i, j) != present.At(i, j)) {
        const Reference reference = FindReference(*this, {level, i, j});
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
  HSplineSurface next = *this;  // so that a failure leaves this surface unchanged
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
  const std::vector<LevelLayout> layout = MakeLayouts(shape_, offsets_);
  for (int l = 1; l <= shape_.max_level; ++l) {
    RowTable influenced(layout[l].influenced, shape_.PatchesV(l)),
        rows(VertexSpans(shape_, l, layout[l].needed), StoredRows(shape_, l));
    if (l < level && influenced == levels_[l].influenced && rows == levels_[l].net.rows()) {
      continue;
    }
    SparseNet net = RefineSparse(shape_, l - 1, levels_[l - 1].net, std::move(rows));
    for (auto it = offsets_.lower_bound({l, 0, 0}); it != offsets_.end() && it->first.level == l;
         ++it) {
      const Reference reference = FindReference(*this, it->first);
      const Vec3 place = reference.origin + reference.axes * it->second;
      for (int row = it->first.j; row < StoredRows(shape_, l); row += Rows(l)) {
        *net.Find(it->first.i, row) = place;
      }
    }
    levels_[l] = {std::move(influenced), std::move(net)};
  }
}

std::size_t HSplineSurface::Bytes() const {
  constexpr std::size_t kNode = 96;  // bytes per entry of the map of offsets, with its allocation
  std::size_t bytes = sizeof(*this) + kNode * offsets_.size() + levels_.capacity() * sizeof(Level);
  for (const Level& level : levels_) {
    bytes += level.influenced.Bytes() + level.net.Bytes();
  }
  return bytes;
}

std::optional<SurfaceCurvature> CurvatureAt(const HSplineSurface& surface, const Vec2& uv) {
  const SurfaceFrame frame = surface.Frame(uv);
  if (!frame.regular) {
    return std::nullopt;
  }
  const SecondDerivatives second = surface.Second(uv);
  const Vec3 normal = frame.Normal();
  Eigen::Matrix2d bend;  // the second fundamental form
  bend << normal.dot(second.duu), normal.dot(second.duv), normal.dot(second.duv),
      normal.dot(second.dvv);
  // Steps in (u,v) along the frame's first two axes t and s, since du = a t and dv = b t + c s.
  const double a = frame.axes.col(0).dot(frame.du), b = frame.axes.col(0).dot(frame.dv),
               c = frame.axes.col(1).dot(frame.dv);
  Eigen::Matrix2d steps;
  steps << 1 / a, -b / (a * c), 0, 1 / c;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(steps.transpose() * bend * steps);
  SurfaceCurvature curvature;
  curvature.smallest_per_mm = solver.eigenvalues()[0];
  curvature.largest_per_mm = solver.eigenvalues()[1];
  curvature.largest_direction = frame.axes.leftCols<2>() * solver.eigenvectors().col(1);
  curvature.smallest_direction = normal.cross(curvature.largest_direction);
  return curvature;
}

}  // namespace semblance::surfaces
