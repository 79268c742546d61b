// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <vector>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/least_squares/qr_compression.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

// Takes a misfit d to one whose square is (n . d)^2 + tangential |d - n (n . d)|^2.
Mat3 Shaping(const TangentPointTerm& term, const LevelView& view, const Vec2& uv) {
  const Vec3 du = view.StencilAt(uv, {1, 0}).Apply(view.start),
             dv = view.StencilAt(uv, {0, 1}).Apply(view.start), normal = du.cross(dv);
  if (normal.norm() <= 1e-12 * (du.squaredNorm() + dv.squaredNorm())) {
    return Mat3::Identity();
  }
  const Vec3 n = normal.normalized();
  const Mat3 along = n * n.transpose();
  return along + std::sqrt(term.tangential) * (Mat3::Identity() - along);
}

// Rows over the coordinates of an element's vertices as rows over those of its dofs.
Eigen::MatrixXd Extracted(const Eigen::MatrixXd& a, const SplineElement& element) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(a.rows(), 3 * element.extraction.cols());
  for (Eigen::Index dof = 0; dof < element.extraction.cols(); ++dof) {
    for (int v = 0; v < 16; ++v) {
      result.middleCols<3>(3 * dof) += element.extraction(v, dof) * a.middleCols<3>(3 * v);
    }
  }
  return result;
}

// Three rows a point, 48 columns.
void AddPatch(const TangentPointTerm& term, const LevelView& view,
              std::span<const Observation> points, double scale, ControlNet& net,
              ceres::Problem& problem) {
  Eigen::MatrixXd a(3 * points.size(), 48);
  Rows3 b = Rows3::Zero(a.rows(), 3);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const LocalStencil s = view.LocalAt(points[k].uv);
    const Mat3 shape = std::sqrt(scale * points[k].weight) * Shaping(term, view, points[k].uv);
    for (int v = 0; v < 16; ++v) {
      a.block<3, 3>(3 * k, 3 * v) = s.weight[v] * shape;
    }
    b.block<3, 1>(3 * k, 0) = shape * points[k].position;
  }
  const SplineElement element = view.Element(view.LocalAt(points.front().uv).element);
  if (!element.IsIdentity()) {
    for (int v = 0; v < 16; ++v) {
      b.col(0) -= a.middleCols<3>(3 * v) * element.fixed.row(v).transpose();
    }
  }
  const LinearRows rows = CompressRows(a, b);
  AddCoupledResidual(element.IsIdentity() ? rows.a : Extracted(rows.a, element), rows.b.col(0),
                     element.dofs, net, problem);
}

}  // namespace

void AddResiduals(const TangentPointTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  constexpr std::size_t kMost = 16384;  // points; 19 MB
  const double scale = term.weight / view.WeightSum();
  const std::span<const Observation> all(view.observations);
  const auto patch = [&](std::size_t k) { return view.LocalAt(all[k].uv).element; };
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    while (end < all.size() && end - begin < kMost && patch(end) == patch(begin)) {
      ++end;
    }
    AddPatch(term, view, all.subspan(begin, end - begin), scale, net, problem);
  }
}

double TermCost(const TangentPointTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (const Observation& o : view.observations) {
    const Vec3 d = view.PointAt(o.uv, net) - o.position;
    sum += o.weight * (Shaping(term, view, o.uv) * d).squaredNorm();
  }
  return view.observations.empty() ? 0 : term.weight * sum / view.WeightSum();
}

}  // namespace semblance
