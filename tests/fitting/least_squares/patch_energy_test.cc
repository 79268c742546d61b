// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/patch_energy.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"
#include "tests/testing/splines.h"

namespace semblance {
namespace {

using testing::PlainStencil;

// Gauss-Legendre nodes and weights on [0,1] from the Golub-Welsch eigenproblem.
struct Quadrature {
  Eigen::VectorXd nodes, weights;
};
Quadrature GaussLegendre(int n) {
  Eigen::MatrixXd jacobi = Eigen::MatrixXd::Zero(n, n);
  for (int k = 1; k < n; ++k) {
    jacobi(k, k - 1) = jacobi(k - 1, k) = k / std::sqrt(4.0 * k * k - 1);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(jacobi);
  return {(eigen.eigenvalues().array() + 1) / 2,
          eigen.eigenvectors().row(0).transpose().cwiseAbs2()};
}

ControlNet RandomNet(int m, int n, std::uint64_t random_seed) {
  Random random(random_seed);
  ControlNet net{.columns = m + 3, .rows = n + 3, .vertices = {}};
  for (int k = 0; k < net.columns * net.rows; ++k) {
    net.vertices.push_back(random.InBox(-10, 10));
  }
  return net;
}

// Integral over [0,1]^2 of |d^(k+l) S / du^k dv^l|^2.
double Integral(const ControlNet& net, int m, int n, int k, int l) {
  const Quadrature q = GaussLegendre(8);
  double sum = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < m; ++i) {
      for (int b = 0; b < 8; ++b) {
        for (int a = 0; a < 8; ++a) {
          const Vec2 uv((i + q.nodes[a]) / m, (j + q.nodes[b]) / n);
          sum += q.weights[a] * q.weights[b] / (m * n) *
                 PlainStencil(m, n, uv, k, l).Apply(net).squaredNorm();
        }
      }
    }
  }
  return sum;
}

TEST(PatchEnergy, FormsEqualQuadratureOfTheDerivatives) {
  const int m = 3, n = 5;
  const double lu = 70, lv = 30;
  const ControlNet net = RandomNet(m, n, 1);
  const PatchGrid grid{.patches_u = m, .patches_v = n};
  const double thin = lu * lv *
                      (Integral(net, m, n, 2, 0) / std::pow(lu, 4) +
                       2 * Integral(net, m, n, 1, 1) / (lu * lu * lv * lv) +
                       Integral(net, m, n, 0, 2) / std::pow(lv, 4));
  const double membrane =
      lu * lv * (Integral(net, m, n, 1, 0) / (lu * lu) + Integral(net, m, n, 0, 1) / (lv * lv));
  EXPECT_NEAR(StiffnessEnergy(ThinPlateStiffness(lu / m, lv / n), grid, net), thin, 1e-11 * thin);
  EXPECT_NEAR(StiffnessEnergy(MembraneStiffness(lu / m, lv / n), grid, net), membrane,
              1e-11 * membrane);
  const Vec2 lengths = MeanLengths(grid, net);
  EXPECT_NEAR(lengths.x(), std::sqrt(Integral(net, m, n, 1, 0)), 1e-11 * lengths.x());
  EXPECT_NEAR(lengths.y(), std::sqrt(Integral(net, m, n, 0, 1)), 1e-11 * lengths.y());
}

// Of tr((M H)^2) from the definition, and of a patch whose sides are stretched instead.
TEST(PatchEnergy, BendingInOtherLengthsIsThatOfItsMetric) {
  const int m = 3, n = 4;
  const double lu = 7, lv = 5;
  const ControlNet net = RandomNet(m, n, 3);
  const BendingMetric metric = MetricOf({.stretch = 2.5, .direction_deg = 35});
  const Quadrature q = GaussLegendre(8);
  double expected = 0;
  for (int k = 0; k < 64 * m * n; ++k) {
    const int patch = k / 64, a = k % 8, b = k / 8 % 8;
    const Vec2 uv((patch % m + q.nodes[a]) / m, (patch / m + q.nodes[b]) / n);
    const auto derivative = [&](int of_u, int of_v) -> Vec3 {
      return PlainStencil(m, n, uv, of_u, of_v).Apply(net) /
             (std::pow(lu, of_u) * std::pow(lv, of_v));
    };
    const Vec3 ss = derivative(2, 0), st = derivative(1, 1), tt = derivative(0, 2);
    for (int c = 0; c < 3; ++c) {
      Eigen::Matrix2d h;
      h << ss[c], st[c], st[c], tt[c];
      expected +=
          q.weights[a] * q.weights[b] / (m * n) * lu * lv * (metric * h * metric * h).trace();
    }
  }
  const PatchGrid grid{.patches_u = m, .patches_v = n};
  EXPECT_NEAR(StiffnessEnergy(ThinPlateStiffness(lu / m, lv / n, metric), grid, net), expected,
              1e-11 * expected);
  const ElementStiffness along_t =
      ThinPlateStiffness(2, 3, MetricOf({.stretch = 4, .direction_deg = 90}));
  EXPECT_LT((along_t - ThinPlateStiffness(2 * 2, 3 / 2.0)).cwiseAbs().maxCoeff(),
            1e-12 * along_t.maxCoeff());
}

TEST(PatchEnergy, RootsReproduceTheFormsAndShowTheirNullSpaces) {
  const ElementStiffness thin = ThinPlateStiffness(2, 3), membrane = MembraneStiffness(2, 3);
  const Eigen::MatrixXd a = StiffnessRoot(thin), b = StiffnessRoot(membrane);
  EXPECT_EQ(a.rows(), 13);  // 1, s and t are free
  EXPECT_EQ(b.rows(), 15);  // 1 is free
  EXPECT_LT((a.transpose() * a - thin).cwiseAbs().maxCoeff(), 1e-13 * thin.maxCoeff());
  EXPECT_LT((b.transpose() * b - membrane).cwiseAbs().maxCoeff(), 1e-13 * membrane.maxCoeff());
}

// Shifting the vertices by one along a closed direction changes nothing.
TEST(PatchEnergy, PeriodicEnergyKnowsNoSeam) {
  for (const bool torus : {false, true}) {
    const PatchGrid grid{.patches_u = 6, .patches_v = 5, .periodic_u = true, .periodic_v = torus};
    Random random(2);
    ControlNet net{.columns = grid.Columns(), .rows = grid.Rows(), .vertices = {}};
    for (int k = 0; k < net.columns * net.rows; ++k) {
      net.vertices.push_back(random.InBox(-1, 1));
    }
    ControlNet along_u = net, along_v = net;
    for (int j = 0; j < net.rows; ++j) {
      for (int i = 0; i < net.columns; ++i) {
        along_u.At((i + 1) % net.columns, j) = net.At(i, j);
        along_v.At(i, (j + 1) % net.rows) = net.At(i, j);
      }
    }
    for (const ElementStiffness& form : {ThinPlateStiffness(1, 2), MembraneStiffness(1, 2)}) {
      const double energy = StiffnessEnergy(form, grid, net);
      EXPECT_GT(energy, 0);
      EXPECT_NEAR(StiffnessEnergy(form, grid, along_u), energy, 1e-12 * energy);
      if (torus) {
        EXPECT_NEAR(StiffnessEnergy(form, grid, along_v), energy, 1e-12 * energy);
      }
    }
  }
}

}  // namespace
}  // namespace semblance
