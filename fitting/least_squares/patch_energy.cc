// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/patch_energy.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace semblance::fitting {
namespace {

using Gram = Eigen::Matrix4d;

// Row a holds the coefficients of 1, t, t^2, t^3 of the a-th cubic B-spline segment on [0,1].
Eigen::Matrix4d SegmentCoefficients() {
  Eigen::Matrix4d c;
  c << 1, -3, 3, -1,  //
      4, 0, -6, 3,    //
      1, 3, 3, -3,    //
      0, 0, 0, 1;
  return c / 6;
}

Eigen::Matrix4d Derivative(const Eigen::Matrix4d& c) {
  Eigen::Matrix4d d = Eigen::Matrix4d::Zero();
  for (int p = 1; p < 4; ++p) {
    d.col(p - 1) = p * c.col(p);
  }
  return d;
}

// The coefficients of the segments' derivatives of the given order, 0 .. 2.
Eigen::Matrix4d DerivativeCoefficients(int order) {
  Eigen::Matrix4d c = SegmentCoefficients();
  for (int k = 0; k < order; ++k) {
    c = Derivative(c);
  }
  return c;
}

// The integrals over [0,1] of one segment's k-th derivative times another's l-th.
Gram SegmentGram(int k, int l) {
  Eigen::Matrix4d moments;  // integrals of t^(p + q)
  for (int p = 0; p < 4; ++p) {
    for (int q = 0; q < 4; ++q) {
      moments(p, q) = 1.0 / (p + q + 1);
    }
  }
  return DerivativeCoefficients(k) * moments * DerivativeCoefficients(l).transpose();
}

struct DerivativeOrders {
  int s = 0, t = 0;
};

// The integral over the patch of one derivative of f times another. The form is symmetric only if
// both are the same.
ElementStiffness ProductForm(const DerivativeOrders& one, const DerivativeOrders& other,
                             double size_s, double size_t) {
  const Gram s = SegmentGram(one.s, other.s) * std::pow(size_s, 1 - one.s - other.s);
  const Gram t = SegmentGram(one.t, other.t) * std::pow(size_t, 1 - one.t - other.t);
  ElementStiffness form;
  for (int row = 0; row < 16; ++row) {
    for (int col = 0; col < 16; ++col) {
      form(row, col) = s(row % 4, col % 4) * t(row / 4, col / 4);
    }
  }
  return form;
}

// The integral over the patch of (d^k/ds^k d^l/dt^l f)^2.
ElementStiffness DerivativeStiffness(int k, int l, double size_s, double size_t) {
  return ProductForm({k, l}, {k, l}, size_s, size_t);
}

}  // namespace

std::array<int, 16> PatchGrid::PatchVertices(int i, int j) const {
  std::array<int, 16> vertices;
  for (int k = 0; k < 16; ++k) {
    vertices[k] = (i + k % 4) % Columns() + Columns() * (j + k / 4);
  }
  return vertices;
}

PatchGrid PatchGrid::Of(const HSplineShape& shape, int level) {
  return {.patches_u = shape.PatchesU(level),
          .patches_v = shape.PatchesV(level),
          .periodic_u = shape.ClosedU()};
}

HSplineShape PatchGrid::Shape() const {
  return {.patches_u = patches_u,
          .patches_v = patches_v,
          .max_level = 0,
          .closure = periodic_u ? Closure::kPeriodicU : Closure::kOpen};
}

Stencil PatchGrid::StencilAt(const Vec2& uv, DerivativeOrder order) const {
  return fitting::StencilAt(Shape(), 0, uv, order);
}

std::array<ElementStiffness, 6> BendingStiffnesses(double size_s, double size_t) {
  constexpr DerivativeOrders kSs = {2, 0}, kSt = {1, 1}, kTt = {0, 2};
  const auto product = [&](const DerivativeOrders& one, const DerivativeOrders& other) {
    return ProductForm(one, other, size_s, size_t);
  };
  const auto mixed = [&](const DerivativeOrders& one, const DerivativeOrders& other) {
    return ElementStiffness((product(one, other) + product(other, one)) / 2);
  };
  return {product(kSs, kSs), product(kSt, kSt), product(kTt, kTt),
          mixed(kSs, kSt),   mixed(kSt, kTt),   mixed(kSs, kTt)};
}

ElementStiffness ThinPlateStiffness(double size_s, double size_t, const BendingMetric& metric) {
  const std::array<ElementStiffness, 6> forms = BendingStiffnesses(size_s, size_t);
  const BendingSums factors = BendingFactors(metric);
  ElementStiffness sum = ElementStiffness::Zero();
  for (std::size_t k = 0; k < forms.size(); ++k) {
    sum += factors[k] * forms[k];
  }
  return sum;
}

ElementStiffness MembraneStiffness(double size_s, double size_t) {
  return DerivativeStiffness(1, 0, size_s, size_t) + DerivativeStiffness(0, 1, size_s, size_t);
}

Eigen::MatrixXd StiffnessRoot(const ElementStiffness& form) {
  const Eigen::SelfAdjointEigenSolver<ElementStiffness> eigen(form);
  const auto& values = eigen.eigenvalues();  // ascending
  int null = 0;
  while (null < 16 && values[null] <= 1e-13 * values[15]) {
    ++null;
  }
  const int rank = 16 - null;
  return values.tail(rank).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().rightCols(rank).transpose();
}

double StiffnessEnergy(const ElementStiffness& form, const PatchGrid& grid, const ControlNet& net) {
  double energy = 0;
  for (int j = 0; j < grid.patches_v; ++j) {
    for (int i = 0; i < grid.patches_u; ++i) {
      const std::array<int, 16> vertices = grid.PatchVertices(i, j);
      Eigen::Matrix<double, 16, 3> x;
      for (int k = 0; k < 16; ++k) {
        x.row(k) = net.vertices[vertices[k]];
      }
      energy += (form * x).cwiseProduct(x).sum();
    }
  }
  return energy;
}

// Far from the origin, round-off of the squares swamps the differences of vertices; there the net
// is first shifted by its first vertex.
Vec2 MeanLengths(const PatchGrid& grid, const ControlNet& net) {
  constexpr double kFar = 1e4;  // distance in extents from which the shift pays; not sensitive
  const Vec3& first = net.vertices.front();
  double extent = 0;
  for (const Vec3& vertex : net.vertices) {
    extent = std::max(extent, (vertex - first).norm());
  }
  ControlNet near = net;
  for (Vec3& vertex : near.vertices) {
    vertex -= first.norm() > kFar * extent ? first : Vec3(Vec3::Zero());
  }
  const double size_u = 1.0 / grid.patches_u, size_v = 1.0 / grid.patches_v;
  return {std::sqrt(StiffnessEnergy(DerivativeStiffness(1, 0, size_u, size_v), grid, near)),
          std::sqrt(StiffnessEnergy(DerivativeStiffness(0, 1, size_u, size_v), grid, near))};
}

Vec2 MeanLengths(const HSplineSurface& surface) {
  return MeanLengths(PatchGrid::Of(surface.shape(), 0), surface.Net(0));
}

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen2 = Eigen::SelfAdjointEigenSolver<Matrix2d>;

constexpr double kPerDegree = std::numbers::pi / 180;

Matrix2d Symmetric(double ss, double st, double tt) {
  return (Matrix2d() << ss, st, st, tt).finished();
}

Matrix2d With(const Eigen2& eigen, const Vector2d& values) {
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

BendingMetric StretchedAtMost(const BendingMetric& metric, double most_stretch) {
  const Eigen2 eigen(metric);
  const double stretch = std::min(eigen.eigenvalues()[1], most_stretch);
  return With(eigen, {1 / stretch, stretch});
}

BendingMetric Normalised(const Matrix2d& m) { return m / std::sqrt(m.determinant()); }

// The integral of H M H over the surface.
Matrix2d BendingThrough(const BendingMetric& m, const BendingSums& sums) {
  const auto& [ss_ss, st_st, tt_tt, ss_st, st_tt, ss_tt] = sums;
  return Symmetric(m(0, 0) * ss_ss + 2 * m(0, 1) * ss_st + m(1, 1) * st_st,
                   m(0, 0) * ss_st + m(0, 1) * (ss_tt + st_st) + m(1, 1) * st_tt,
                   m(0, 0) * st_st + 2 * m(0, 1) * st_tt + m(1, 1) * tt_tt);
}

}  // namespace

BendingMetric MakeBendingMetric(const BendingStretch& s) {
  if (s.stretch == 1) {
    return BendingMetric::Identity();
  }
  const double turn = s.direction_deg * kPerDegree;
  const Vector2d along(std::cos(turn), std::sin(turn)), across(-along.y(), along.x());
  return s.stretch * along * along.transpose() + across * across.transpose() / s.stretch;
}

BendingStretch FindStretch(const BendingMetric& metric) {
  const Eigen2 eigen(metric);
  const double stretch = eigen.eigenvalues()[1];
  if (!(stretch > 1)) {
    return {};
  }
  const Vector2d along = eigen.eigenvectors().col(1);
  const double direction_deg = std::atan2(along.y(), along.x()) / kPerDegree;
  return {.stretch = stretch, .direction_deg = std::fmod(direction_deg + 360, 180)};
}

BendingSums BendingFactors(const BendingMetric& metric) {
  const double ss = metric(0, 0), st = metric(0, 1), tt = metric(1, 1);
  return {ss * ss, 2 * (ss * tt + st * st), tt * tt, 4 * ss * st, 4 * st * tt, 2 * st * st};
}

double BendingIn(const BendingMetric& metric, const BendingSums& sums) {
  const BendingSums factors = BendingFactors(metric);
  return std::inner_product(factors.begin(), factors.end(), sums.begin(), 0.0);
}

// Among metrics of determinant 1 the gradient of bending vanishes where M^-1 is proportional to the
// integral of H M H. Iterating this map alone oscillates about the fixed point. The geometric mean
// of the old and the new metric does not; for two matrices of determinant 1 it is their sum,
// divided by the root of its determinant.
BendingMetric MetricOfLeastBending(const BendingSums& sums, double most_stretch) {
  constexpr int kSteps = 30;  // enough to converge to round-off
  BendingMetric metric = BendingMetric::Identity();
  for (int k = 0; k < kSteps; ++k) {
    const Matrix2d through = BendingThrough(metric, sums);
    if (!(through.determinant() > 0)) {
      break;  // the surface bends along one direction alone, or not at all
    }
    metric = Normalised(metric + Normalised(through.inverse()));
  }
  return StretchedAtMost(metric, most_stretch);
}

BendingMetric MetricBeyond(const BendingMetric& from, const BendingMetric& to,
                           double most_stretch) {
  return StretchedAtMost(to * from.inverse() * to, most_stretch);
}

double StretchBetween(const BendingMetric& one, const BendingMetric& other) {
  const double half = (one.inverse() * other).trace() / 2;
  return half + std::sqrt(std::max(half * half - 1, 0.0));
}

}  // namespace semblance::fitting
