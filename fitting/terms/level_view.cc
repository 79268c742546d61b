// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/terms/level_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "fitting/least_squares/qr_compression.h"
#include "surfaces/base/error.h"

namespace semblance::fitting {
namespace {

// The whole point, before the detail of finer levels is taken off.
Observation Observe(const FitPoint& point) {
  return {.uv = point.uv,
          .position = point.position,
          .weight = point.weight,
          .landmark = point.role == PointRole::kLandmark};
}

// Takes the detail that finer levels add at uv off the point, if the level aims at the whole
// surface.
Observation WithoutFiner(Observation o, const HSplineSurface& surface, int level, FitAim aim) {
  if (aim == FitAim::kSurface && level < surface.shape().max_level) {
    o.position -= surface.Point(o.uv) - surface.LevelDerivative(level, o.uv);
  }
  return o;
}

// LevelView::likely before the detail of finer levels is taken off; the points of a patch stand
// together.
std::vector<Observation> LikelyShape(const HSplineShape& shape,
                                     const std::vector<ShapePoint>& points) {
  double all = 0;
  for (const ShapePoint& point : points) {
    all += point.share;
  }
  std::vector<Observation> likely;
  for (const ShapePoint& point : points) {
    likely.push_back({.uv = point.uv,
                      .position = point.position,
                      .weight = point.share / (all * point.sd_mm * point.sd_mm)});
  }
  SortObservations(PointCloud(shape, likely), likely);
  return likely;
}

// Adds a bone observation if the point has a foot. The detail that was taken off the point is taken
// off the foot too.
void AddBone(const BoneAnchor& anchor, const Vec3& given, const Observation& o, LevelView& view) {
  if (anchor.foot.allFinite()) {
    view.bone.push_back({o, anchor.foot - (given - o.position), anchor.direction});
  }
}

// LevelView::finer_in_rows.
std::vector<Vec3> FinerInRows(const HSplineSurface& surface, int level,
                              const ViewOptions& options) {
  std::vector<Vec3> finer;
  for (const Term& term : options.terms) {
    const auto* const rows = std::get_if<RowsTerm>(&term);
    for (const LinearRow& row : rows == nullptr ? std::vector<LinearRow>() : rows->rows) {
      Vec3 sum = Vec3::Zero();
      for (const auto& [u, v, du, dv, c] : row.at) {
        const DerivativeOrder order{static_cast<int>(du), static_cast<int>(dv)};
        sum +=
            c * (surface.Derivative({u, v}, order) - surface.LevelDerivative(level, {u, v}, order));
      }
      finer.push_back(sum);
    }
  }
  return finer;
}

}  // namespace

double LevelView::WeightSum() const {
  double sum = 0;
  for (const Observation& o : observations) {
    sum += o.weight;
  }
  return sum;
}

double LevelView::LandmarkWeightSum() const {
  double sum = 0;
  for (const Observation& o : observations) {
    sum += o.landmark ? o.weight : 0;
  }
  return sum;
}

int LevelView::elements() const {
  return space != nullptr ? space->size() : grid.patches_u * grid.patches_v;
}

SplineElement LevelView::Element(int element) const {
  if (space != nullptr) {
    return (*space)[element];
  }
  const int i = element % grid.patches_u, j = element / grid.patches_u;
  const std::array<int, 16> vertices = grid.PatchVertices(i, j);
  SplineElement result{.patch = {0, i, j},
                       .patches_u = grid.patches_u,
                       .patches_v = grid.patches_v,
                       .dofs = {vertices.begin(), vertices.end()}};
  for (int k = 0; k < 16; ++k) {
    result.rest.row(k) = rest.vertices[vertices[k]];
  }
  return result;
}

LocalStencil LevelView::LocalAt(const Vec2& uv, DerivativeOrder order) const {
  if (space != nullptr) {
    const int element = space->At(uv);
    const PatchPoint at = PatchPointAt(space->shape(), (*space)[element].patch.level, uv);
    return {element, PatchWeights(space->shape(), at, order)};
  }
  const HSplineShape shape = grid.Shape();
  CheckParameter(shape, 0, uv);
  const PatchPoint at = PatchPointAt(shape, 0, uv);
  return {at.patch.i + grid.patches_u * at.patch.j, PatchWeights(shape, at, order)};
}

DofStencil LevelView::StencilAt(const Vec2& uv, DerivativeOrder order) const {
  DofStencil stencil;
  if (space == nullptr) {
    const Stencil plain = grid.StencilAt(uv, order);
    stencil.count = 16;
    std::copy(plain.index.begin(), plain.index.end(), stencil.index.begin());
    std::copy(plain.weight.begin(), plain.weight.end(), stencil.weight.begin());
    return stencil;
  }
  const LocalStencil local = LocalAt(uv, order);
  const SplineElement& element = (*space)[local.element];
  const Eigen::Map<const Eigen::Matrix<double, 1, 16>> weights(local.weight.data());
  stencil.count = static_cast<int>(element.dofs.size());
  std::copy(element.dofs.begin(), element.dofs.end(), stencil.index.begin());
  Eigen::Map<Eigen::RowVectorXd>(stencil.weight.data(), stencil.count) =
      weights * element.extraction;
  stencil.fixed = (weights * element.fixed).transpose();
  return stencil;
}

Vec3 LevelView::PointAt(const Vec2& uv, const ControlNet& net, DerivativeOrder order) const {
  return space == nullptr ? grid.StencilAt(uv, order).Apply(net) : StencilAt(uv, order).Apply(net);
}

void AddElementRows(const SplineElement& element, std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                    RowSink& sink) {
  if (element.IsIdentity()) {
    sink.Add(std::move(a), std::move(b), element.dofs);
    return;
  }
  LinearRows rows = CompressRows(*a, b - *a * element.fixed);
  sink.Add(std::make_shared<const Eigen::MatrixXd>(rows.a * element.extraction), std::move(rows.b),
           element.dofs);
}

LevelView MakeLevelView(const HSplineSurface& surface, const HSplineSurface& rest,
                        const FitTarget& target, int level, const ViewOptions& options) {
  const HSplineShape& shape = surface.shape();
  if (level < 0 || level > shape.max_level || !(shape == rest.shape())) {
    throw InputError(fmt::format(
        "level {} of a surface with levels 0..{}; give one of them, and a template of the same "
        "shape",
        level, shape.max_level));
  }
  LevelView view{.grid = PatchGrid::Of(shape, level),
                 .start = surface.Net(level),
                 .rest = rest.Net(level),
                 .lengths_mm = MeanLengths(rest),
                 .observations = {}};
  view.observations.reserve(target.points.size());
  for (const FitPoint& point : target.points) {
    view.observations.push_back(WithoutFiner(Observe(point), surface, level, options.aim));
  }
  for (std::size_t k = 0; k < target.anchors.size(); ++k) {
    AddBone(target.anchors[k], target.points[k].position, view.observations[k], view);
  }
  for (const VertexId& vertex : options.held) {
    if (vertex.level == level) {
      view.held.push_back(view.start.Index(vertex.i, vertex.j));
    }
  }
  view.likely = LikelyShape(shape, target.shape);
  for (Observation& o : view.likely) {
    o = WithoutFiner(o, surface, level, options.aim);
  }
  if (options.aim == FitAim::kSurface && level < shape.max_level) {
    view.finer_in_rows = FinerInRows(surface, level, options);
  }
  return view;
}

// Permutes in place, cycle by cycle: a copy of a million observations would take most of a fit's
// memory.
void SortObservations(const PointCloud& cloud, std::vector<Observation>& observations) {
  std::vector<bool> is_placed(observations.size(), false);
  for (std::size_t begin = 0; begin < observations.size(); ++begin) {
    if (is_placed[begin]) {
      continue;
    }
    const Observation first = observations[begin];
    std::size_t k = begin;
    for (std::size_t from = cloud.Given(k); from != begin; from = cloud.Given(k)) {
      observations[k] = observations[from];
      is_placed[k] = true;
      k = from;
    }
    observations[k] = first;
    is_placed[k] = true;
  }
}

LevelView MakeSpaceView(const HierarchicalSplineSpace& space, const PointCloud& cloud,
                        const FitTarget& target, const Vec2& lengths_mm) {
  const auto elements = std::make_shared<const SplineElements>(space);
  LevelView view{.grid = {},
                 .start = space.Values(),
                 .rest = space.RestValues(),
                 .lengths_mm = lengths_mm,
                 .observations = {},
                 .space = elements};
  view.observations.reserve(cloud.points().size());
  for (std::size_t k = 0; k < cloud.points().size(); ++k) {
    const FitPoint& point = target.points[cloud.Given(k)];
    const Observation& o = view.observations.emplace_back(Observe(point));
    if (!target.anchors.empty()) {
      AddBone(target.anchors[cloud.Given(k)], point.position, o, view);
    }
  }
  view.likely = LikelyShape(space.shape(), target.shape);
  return view;
}

}  // namespace semblance::fitting
