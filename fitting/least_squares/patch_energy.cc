// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/patch_energy.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

using Gram = Eigen::Matrix4d;

// Row a: coefficients of 1, t, t^2, t^3 of the a-th cubic B-spline segment on [0,1].
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

// Of the `order`-th derivatives of the segments, order 0..2.
Eigen::Matrix4d DerivativeCoefficients(int order) {
  Eigen::Matrix4d c = SegmentCoefficients();
  for (int k = 0; k < order; ++k) {
    c = Derivative(c);
  }
  return c;
}

// Integrals over [0,1] of a segment's k-th derivative times another's l-th.
Gram SegmentGram(int k, int l) {
  Eigen::Matrix4d moments;  // of t^(p + q)
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

// Integral over the patch of one derivative of f times another; symmetric only if they are the
// same.
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

// Integral over the patch of (d^k/ds^k d^l/dt^l f)^2.
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
  return semblance::StencilAt(Shape(), 0, uv, order);
}

std::array<ElementStiffness, 6> BendingStiffnesses(double size_s, double size_t) {
  constexpr DerivativeOrders kSs = {2, 0}, kSt = {1, 1}, kTt = {0, 2};
  const auto of = [&](const DerivativeOrders& one, const DerivativeOrders& other) {
    return ProductForm(one, other, size_s, size_t);
  };
  const auto mixed = [&](const DerivativeOrders& one, const DerivativeOrders& other) {
    return ElementStiffness((of(one, other) + of(other, one)) / 2);
  };
  return {of(kSs, kSs),    of(kSt, kSt),    of(kTt, kTt),
          mixed(kSs, kSt), mixed(kSt, kTt), mixed(kSs, kTt)};
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

// Far from the origin the squares leave nothing of differences; there, about its first vertex.
Vec2 MeanLengths(const PatchGrid& grid, const ControlNet& net) {
  constexpr double kFar = 1e4;  // extents
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

}  // namespace semblance
