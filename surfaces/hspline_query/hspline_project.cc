// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/hspline_project.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/hspline/patch_tree.h"

namespace semblance::surfaces {
namespace {

using Mat2 = Eigen::Matrix2d;

void CheckOptions(const ProjectOptions& o) {
  if (o.samples_per_patch < 1 || o.starts < 1 || o.max_iterations < 1 || !(o.tolerance_mm > 0)) {
    throw InputError(fmt::format(
        "projection: samples_per_patch {}, starts {}, max_iterations {} and tolerance_mm {} must "
        "all be positive",
        o.samples_per_patch, o.starts, o.max_iterations, o.tolerance_mm));
  }
}

void CheckPoint(const Vec3& point) {
  if (!point.allFinite()) {
    throw InputError(fmt::format("projection: the point ({}, {}, {}) is not finite", point.x(),
                                 point.y(), point.z()));
  }
}

// Brings x into the domain. Along a closed direction round-off may give 1, which becomes 0.
double IntoDomain(double x, bool closed) {
  const double inside = IntoUnit(x, closed);
  return closed && !(inside < 1) ? 0 : inside;
}

Vec2 IntoDomain(const HSplineShape& shape, const Vec2& uv) {
  return {IntoDomain(uv.x(), shape.ClosedU()), std::clamp(uv.y(), 0.0, 1.0)};
}

// Half the squared distance at one (u,v), with its first and second derivatives.
struct Slope {
  Vec3 residual;
  Mat2 squares;   // J^T J
  Mat2 hessian;   // J^T J plus the curvature terms
  Vec2 gradient;  // per unit of u and v
  double Value() const { return residual.squaredNorm() / 2; }
};

Slope SlopeAt(const HSplineSurface& surface, const Vec3& point, const Vec2& uv) {
  const SurfaceFrame frame = surface.Frame(uv);
  const SecondDerivatives second = surface.Second(uv);
  Slope s;
  s.residual = frame.point - point;
  Eigen::Matrix<double, 3, 2> jacobian;
  jacobian << frame.du, frame.dv;
  s.squares = jacobian.transpose() * jacobian;
  s.gradient = jacobian.transpose() * s.residual;
  const double uu = second.duu.dot(s.residual), uv_ = second.duv.dot(s.residual),
               vv = second.dvv.dot(s.residual);
  s.hessian = s.squares;
  s.hessian += (Mat2() << uu, uv_, uv_, vv).finished();
  return s;
}

// Fixes the coordinates whose negative gradient points out of the domain at a border.
void HoldBorders(const HSplineShape& shape, const Vec2& uv, Slope& s) {
  for (int k = 0; k < 2; ++k) {
    const bool has_border = k == 1 || !shape.ClosedU();
    const bool presses = (uv[k] <= 0 && s.gradient[k] > 0) || (uv[k] >= 1 && s.gradient[k] < 0);
    if (has_border && presses) {
      s.gradient[k] = 0;
      for (Mat2* m : {&s.squares, &s.hessian}) {
        const double diagonal = s.squares(k, k) > 0 ? s.squares(k, k) : 1;
        m->row(k).setZero();
        m->col(k).setZero();
        (*m)(k, k) = diagonal;
      }
    }
  }
}

// Newton's step, or a slightly damped Gauss-Newton step if the distance is not convex. Both
// thresholds guard against round-off only.
Vec2 NewtonStep(const Slope& s) {
  const Eigen::LLT<Mat2> newton(s.hessian);
  const double trace = s.squares.trace();
  const bool convex =
      newton.info() == Eigen::Success && s.hessian.determinant() > 1e-12 * s.squares.determinant();
  if (convex) {
    return -newton.solve(s.gradient);
  }
  const Mat2 damped = s.squares + 1e-9 * (trace > 0 ? trace : 1) * Mat2::Identity();
  return -damped.llt().solve(s.gradient);
}

Vec2 DiagonalStep(const Slope& s) {
  const Vec2 diagonal = s.squares.diagonal();
  return (diagonal.array() > 0).select(-s.gradient.cwiseQuotient(diagonal), Vec2::Zero());
}

// Halves the step until the distance decreases enough (Armijo), and returns the new (u,v), or `uv`
// if no step does. 1e-4 is the usual value (Nocedal & Wright 2006).
Vec2 Backtrack(const HSplineSurface& surface, const Vec3& point, const Vec2& uv, const Slope& s,
               const Vec2& step) {
  // The most that round-off in the surface's point may add to the value.
  const double slack = 16 * std::numeric_limits<double>::epsilon() * s.residual.norm() *
                       (s.residual.norm() + point.norm());
  for (double a = 1; a > 1e-9; a /= 2) {
    Vec2 moved = a * step;
    const Vec2 next = IntoDomain(surface.shape(), uv + moved);
    if (!surface.shape().ClosedU()) {
      moved.x() = next.x() - uv.x();
    }
    moved.y() = next.y() - uv.y();
    const double value = (surface.Point(next) - point).squaredNorm() / 2;
    if (value <= s.Value() + slack + 1e-4 * s.gradient.dot(moved)) {
      return next;
    }
  }
  return uv;
}

double StepLength(const Vec2& step, const Mat2& squares) {
  return std::sqrt(std::max(0.0, step.dot(squares * step)));
}

int GridLevel(const HSplineSurface& surface) {
  constexpr int kMaxSamplePatches = 65536;
  const HSplineShape& shape = surface.shape();
  int level = surface.Offsets().empty() ? 0 : surface.Offsets().rbegin()->first.level;
  while (level > 0 && shape.PatchesU(level) * shape.PatchesV(level) > kMaxSamplePatches) {
    --level;
  }
  return level;
}

}  // namespace

SurfaceProjection ProjectFrom(const HSplineSurface& surface, const Vec3& point, const Vec2& start,
                              const ProjectOptions& options) {
  CheckOptions(options);
  CheckPoint(point);
  SurfaceProjection result;
  result.uv = IntoDomain(surface.shape(), start);
  for (result.iterations = 0; result.iterations < options.max_iterations && !result.converged;
       ++result.iterations) {
    Slope s = SlopeAt(surface, point, result.uv);
    HoldBorders(surface.shape(), result.uv, s);
    const Vec2 step = NewtonStep(s);
    Vec2 next = Backtrack(surface, point, result.uv, s, step);
    if (next == result.uv) {  // a border turned the step uphill, which it cannot do to a gradient
                              // step
      next = Backtrack(surface, point, result.uv, s, DiagonalStep(s));
    }
    result.converged = StepLength(step, s.squares) <= options.tolerance_mm;
    if (next == result.uv) {
      break;
    }
    result.uv = next;
  }
  result.point = surface.Point(result.uv);
  result.distance_mm = (result.point - point).norm();
  return result;
}

SurfaceProjector::SurfaceProjector(const HSplineSurface& surface, const ProjectOptions& options)
    : surface_(surface), options_(options) {
  CheckOptions(options);
  const HSplineShape& shape = surface.shape();
  const int level = GridLevel(surface);
  quads_u_ = options.samples_per_patch * shape.PatchesU(level);
  quads_v_ = options.samples_per_patch * shape.PatchesV(level);
  columns_ = quads_u_ + (shape.ClosedU() ? 0 : 1);
  rows_ = quads_v_ + 1;
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      samples_.push_back(surface.Point({double(i) / quads_u_, double(j) / quads_v_}));
    }
  }
  const PatchTree tree(surface);
  for (const PatchId& leaf : tree.leaves()) {
    if (leaf.level > level) {
      fine_uv_.emplace_back((leaf.i + 0.5) / shape.PatchesU(leaf.level),
                            (leaf.j + 0.5) / shape.PatchesV(leaf.level));
      fine_.push_back(surface.Point(fine_uv_.back()));
    }
  }
}

std::vector<Vec2> SurfaceProjector::Starts(const Vec3& point) const {
  const HSplineShape& shape = surface_.shape();
  std::vector<double> squared(samples_.size());
  std::transform(samples_.begin(), samples_.end(), squared.begin(),
                 [&](const Vec3& s) { return (s - point).squaredNorm(); });
  const auto beside = [](int k, int count, bool closed) {
    return closed ? (k + count) % count : std::clamp(k, 0, count - 1);
  };
  const auto at = [&](int i, int j) {
    return squared[beside(i, columns_, shape.ClosedU()) + columns_ * beside(j, rows_, false)];
  };
  std::vector<std::pair<double, int>> valleys;
  for (int j = 0; j < rows_; ++j) {
    for (int i = 0; i < columns_; ++i) {
      const double here = at(i, j);
      if (here <= at(i - 1, j) && here <= at(i + 1, j) && here <= at(i, j - 1) &&
          here <= at(i, j + 1)) {
        valleys.emplace_back(here, i + columns_ * j);
      }
    }
  }
  const std::size_t count = std::min<std::size_t>(valleys.size(), options_.starts);
  std::partial_sort(valleys.begin(), valleys.begin() + count, valleys.end());
  std::vector<Vec2> starts;
  for (std::size_t k = 0; k < count; ++k) {
    const int i = valleys[k].second % columns_, j = valleys[k].second / columns_;
    starts.emplace_back(double(i) / quads_u_, double(j) / quads_v_);
  }
  const auto nearest =
      std::min_element(fine_.begin(), fine_.end(), [&](const Vec3& a, const Vec3& b) {
        return (a - point).squaredNorm() < (b - point).squaredNorm();
      });
  if (nearest != fine_.end()) {
    starts.push_back(fine_uv_[nearest - fine_.begin()]);
  }
  return starts;
}

SurfaceProjection SurfaceProjector::Project(const Vec3& point) const {
  CheckPoint(point);
  SurfaceProjection best;
  for (const Vec2& start : Starts(point)) {
    const SurfaceProjection found = ProjectFrom(surface_, point, start, options_);
    if (!(found.distance_mm >= best.distance_mm)) {
      best = found;
    }
  }
  return best;
}

}  // namespace semblance::surfaces
