// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"
#include "tests/testing/splines.h"

namespace semblance::fitting {
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

// The integral over [0,1]^2 of |d^(k+l) S / du^k dv^l|^2.
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

// Compares the integral of tr((M H)^2) with its definition, and with the energy of a patch whose
// sides are stretched instead.
TEST(PatchEnergy, BendingInAMetricEqualsItsDefinition) {
  const int m = 3, n = 4;
  const double lu = 7, lv = 5;
  const ControlNet net = RandomNet(m, n, 3);
  const BendingMetric metric = MakeBendingMetric({.stretch = 2.5, .direction_deg = 35});
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
      ThinPlateStiffness(2, 3, MakeBendingMetric({.stretch = 4, .direction_deg = 90}));
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
TEST(PatchEnergy, PeriodicEnergyHasNoSeam) {
  const PatchGrid grid{.patches_u = 6, .patches_v = 5, .periodic_u = true};
  Random random(2);
  ControlNet net{.columns = grid.Columns(), .rows = grid.Rows(), .vertices = {}};
  for (int k = 0; k < net.columns * net.rows; ++k) {
    net.vertices.push_back(random.InBox(-1, 1));
  }
  ControlNet shifted = net;
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      shifted.At((i + 1) % net.columns, j) = net.At(i, j);
    }
  }
  for (const ElementStiffness& form : {ThinPlateStiffness(1, 2), MembraneStiffness(1, 2)}) {
    const double energy = StiffnessEnergy(form, grid, net);
    EXPECT_GT(energy, 0);
    EXPECT_NEAR(StiffnessEnergy(form, grid, shifted), energy, 1e-12 * energy);
  }
}

using Eigen::Matrix2d;

// Random second derivatives, which bend `more` times as much across a direction as along it.
std::vector<Matrix2d> Hessians(double direction_deg, double more, std::uint64_t seed) {
  Random random(seed);
  const double turn = direction_deg * std::numbers::pi / 180;
  const Matrix2d axes = Eigen::Rotation2Dd(turn).toRotationMatrix();
  std::vector<Matrix2d> all;
  for (int k = 0; k < 500; ++k) {
    const double along = random.Normal(), mixed = random.Normal(), across = random.Normal();
    Matrix2d h;
    h << along, mixed * more, mixed * more, across * more * more;
    all.emplace_back(axes * h * axes.transpose());
  }
  return all;
}

BendingSums SumsOf(const std::vector<Matrix2d>& hessians) {
  BendingSums sums{};
  for (const Matrix2d& h : hessians) {
    const double ss = h(0, 0), st = h(0, 1), tt = h(1, 1);
    const BendingSums here = {ss * ss, st * st, tt * tt, ss * st, st * tt, ss * tt};
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k] += here[k];
    }
  }
  return sums;
}

TEST(BendingMetric, HasItsStretchAndDirection) {
  for (const double stretch : {1.5, 4.0, 20.0}) {
    for (const double direction_deg : {0.0, 10.0, 90.0, 135.0, 179.0}) {
      const BendingMetric metric =
          MakeBendingMetric({.stretch = stretch, .direction_deg = direction_deg});
      EXPECT_NEAR(metric.determinant(), 1, 1e-12);
      const BendingStretch found = FindStretch(metric);
      EXPECT_NEAR(found.stretch, stretch, 1e-9);
      const double apart = std::abs(found.direction_deg - direction_deg);
      EXPECT_LT(std::min(apart, 180 - apart), 1e-6) << "0 and 180 degrees are one direction";
      EXPECT_NEAR(StretchBetween(BendingMetric::Identity(), metric), stretch, 1e-6 * stretch);
      EXPECT_NEAR(StretchBetween(metric, metric), 1, 1e-5);
    }
  }
  EXPECT_EQ(MakeBendingMetric({}), BendingMetric::Identity());
  EXPECT_EQ(FindStretch(BendingMetric::Identity()).stretch, 1);
}

TEST(BendingMetric, CountsBendingAsDefined) {
  const std::vector<Matrix2d> hessians = Hessians(20, 2, 1);
  const BendingMetric metric = MakeBendingMetric({.stretch = 3, .direction_deg = 70});
  double bending = 0;
  for (const Matrix2d& h : hessians) {
    bending += (metric * h * metric * h).trace();
  }
  EXPECT_NEAR(BendingIn(metric, SumsOf(hessians)), bending, 1e-10 * bending);
}

TEST(BendingMetric, NoOtherMetricBendsLess) {
  for (const double direction_deg : {0.0, 30.0, 90.0, 160.0}) {
    const BendingSums sums = SumsOf(Hessians(direction_deg, 3, 2));
    const BendingMetric found = MetricOfLeastBending(sums, 100);
    const double least = BendingIn(found, sums);
    for (double stretch = 1; stretch < 20; stretch *= 1.1) {
      for (int turn_deg = 0; turn_deg < 180; turn_deg += 5) {
        const BendingMetric other =
            MakeBendingMetric({.stretch = stretch, .direction_deg = static_cast<double>(turn_deg)});
        EXPECT_GE(BendingIn(other, sums), (1 - 1e-9) * least);
      }
    }
    const BendingStretch stretch = FindStretch(found);
    EXPECT_NEAR(stretch.stretch, 3, 0.3);
    EXPECT_NEAR(std::cos((stretch.direction_deg - direction_deg) * std::numbers::pi / 90), 1, 0.01);
    EXPECT_NEAR(FindStretch(MetricOfLeastBending(sums, 2)).stretch, 2, 1e-9);
  }
}

TEST(BendingMetric, OfAPlaneIsTheIdentity) {
  EXPECT_EQ(MetricOfLeastBending({}, 100), BendingMetric::Identity());
}

TEST(BendingMetric, MetricBeyondContinuesByTheSameStretch) {
  const BendingMetric one = MakeBendingMetric({.stretch = 2, .direction_deg = 30}),
                      beyond = MetricBeyond(BendingMetric::Identity(), one, 100);
  EXPECT_NEAR(FindStretch(beyond).stretch, 4, 1e-9);
  EXPECT_NEAR(FindStretch(beyond).direction_deg, 30, 1e-6);
  EXPECT_NEAR(FindStretch(MetricBeyond(BendingMetric::Identity(), one, 3)).stretch, 3, 1e-9);
  const BendingMetric other = MakeBendingMetric({.stretch = 5, .direction_deg = 100});
  EXPECT_NEAR(StretchBetween(one, MetricBeyond(other, one, 1e6)), StretchBetween(other, one), 1e-4);
}

}  // namespace
}  // namespace semblance::fitting
