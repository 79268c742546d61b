// SPDX-License-Identifier: GPL-3.0-or-later
// Selected inverses, and Matern fields on surfaces, compared with closed forms and dense matrices.
#include "interp/on_surface/matern_field.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <tuple>

#include "tests/testing/dowel_scenes.h"

namespace semblance::interp {
namespace {

using testing::Joined;
using testing::OnThreads;
using testing::Plate;
using testing::SameBytes;
using testing::SphereMesh;

MaternDomain MakeDomain(const TriMesh& mesh) { return {mesh.points, BuildLaplacian(mesh)}; }

// Two pieces and a vertex of no triangle, with slivers and triangles without area.
TriMesh RoughMesh() {
  TriMesh plate = Plate(60, 9);
  plate.points[7] = plate.points[8];
  plate.points[22] = plate.points[21] + Vec3(1e-9, 1e-9, 0);
  TriMesh mesh = Joined(plate, SphereMesh({0, 0, 50}, 20, 8));
  mesh.points.emplace_back(0, 0, 200);
  return mesh;
}

// The covariances of all vertices from the definition.
Eigen::MatrixXd DenseCovariance(const MaternDomain& domain, int alpha, double kappa) {
  const Eigen::MatrixXd area = domain.laplacian.area_mm2.asDiagonal();
  const Eigen::MatrixXd k = kappa * kappa * area + Eigen::MatrixXd(domain.laplacian.stiffness);
  Eigen::MatrixXd precision = k;
  for (int power = 1; power < alpha; ++power) {
    precision = precision * area.inverse() * k;
  }
  return precision.inverse();
}

Eigen::MatrixXd UnitColumns(Eigen::Index rows, const std::vector<int>& vertices) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(rows, std::ssize(vertices));
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    columns(vertices[k], static_cast<Eigen::Index>(k)) = 1;
  }
  return columns;
}

int NearestVertex(const TriMesh& mesh, const Vec3& p) {
  return static_cast<int>(
      std::ranges::min_element(mesh.points, {}, [&](const Vec3& q) { return (q - p).norm(); }) -
      mesh.points.begin());
}

TEST(SelectedInverse, IsTheDenseInverseAtVerticesAndEdges) {
  const TriMesh mesh = RoughMesh();
  const MaternDomain domain = MakeDomain(mesh);
  const Eigen::SparseMatrix<double> matrix = ShiftedStiffness(domain.laplacian, 0.01);
  const Eigen::SparseMatrix<double> selected =
      MeshSolver(mesh.points, matrix).SelectedInverse(matrix);
  const Eigen::MatrixXd inverse = Eigen::MatrixXd(matrix).inverse();
  EXPECT_EQ(selected.nonZeros(), matrix.nonZeros());
  for (int column = 0; column < selected.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(selected, column); it; ++it) {
      const double dense = inverse(it.row(), it.col());
      ASSERT_NEAR(it.value(), dense, 1e-10 * (1 + std::abs(dense)));
    }
  }
}

class EveryAlpha : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(MaternField, EveryAlpha, ::testing::Values(1, 2, 3));

TEST_P(EveryAlpha, CovariancesAreTheDenseOnes) {
  const TriMesh mesh = RoughMesh();
  const MaternDomain domain = MakeDomain(mesh);
  const MaternField field(domain, GetParam(), 0.08);
  const Eigen::MatrixXd dense = DenseCovariance(domain, GetParam(), 0.08);
  const std::vector<int> vertices = {0, 31, 120};
  const Eigen::MatrixXd some = field.Covariances(UnitColumns(dense.rows(), vertices), {});
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const Eigen::VectorXd column = dense.col(vertices[k]);
    EXPECT_LT((some.col(static_cast<Eigen::Index>(k)) - column).norm(), 1e-8 * column.norm());
  }
  const Eigen::SparseMatrix<double> local = field.LocalCovariances();
  for (int column = 0; column < local.outerSize(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(local, column); it; ++it) {
      const double scale = std::sqrt(dense(it.row(), it.row()) * dense(column, column));
      ASSERT_NEAR(it.value(), dense(it.row(), column), 1e-5 * scale);
    }
  }
}

TEST_P(EveryAlpha, TheNumberOfThreadsDoesNotMatter) {
  const MaternDomain domain = MakeDomain(SphereMesh({0, 0, 0}, 30, 20));
  const MaternField field(domain, GetParam(), 0.1);
  std::vector<int> vertices(40);
  for (int k = 0; k < 40; ++k) {
    vertices[static_cast<std::size_t>(k)] = 17 * k;
  }
  const Eigen::MatrixXd right = UnitColumns(std::ssize(domain.points), vertices);
  const Eigen::MatrixXd one = field.Covariances(right, OnThreads(1)),
                        two = field.Covariances(right, OnThreads(2));
  EXPECT_TRUE((one.array() == two.array()).all());
}

// (kappa r)^nu K_nu(kappa r) / (2^(nu - 1) gamma(nu)), and a variance of
// gamma(nu) / (gamma(alpha) 4 pi kappa^(2 nu)): Lindgren, Rue & Lindstrom 2011, eq. 1.
TEST(MaternField, FarFromABorderIsThePlanesMaternCovariance) {
  const TriMesh plate = Plate(160, 80);
  const MaternDomain domain = MakeDomain(plate);
  const int center = NearestVertex(plate, {80, 80, 0});
  for (const int alpha : {2, 3}) {
    const double nu = alpha - 1, length_mm = 14, kappa = MaternKappa(alpha, length_mm);
    EXPECT_NEAR(kappa, std::sqrt(2 * nu) / length_mm, 1e-12);
    const Eigen::VectorXd column =
        MaternField(domain, alpha, kappa)
            .Covariances(UnitColumns(std::ssize(plate.points), {center}), {});
    const double variance =
        std::tgamma(nu) / (std::tgamma(nu + 1) * 4 * std::numbers::pi * std::pow(kappa, 2 * nu));
    EXPECT_NEAR(column[center], variance, 0.03 * variance);  // edges of a seventh of the length
    for (double r = 4; r <= 40; r += 4) {
      const double x = kappa * r;
      const double matern =
          std::pow(x, nu) * std::cyl_bessel_k(nu, x) / (std::pow(2.0, nu - 1) * std::tgamma(nu));
      for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, -1, 0)}) {
        const int at = NearestVertex(plate, Vec3(80, 80, 0) + r * way);
        EXPECT_NEAR(column[at] / variance, matern, 0.01) << alpha << " " << r;
      }
    }
  }
}

// Left of a change of the length the field has the one length, right of it the other.
TEST(MaternField, WhereTheLengthIsHalfTheCorrelationIsThatOfHalfTheLength) {
  const TriMesh plate = Plate(160, 160);
  const double length_mm = 16;
  Eigen::VectorXd share(std::ssize(plate.points));
  for (Eigen::Index i = 0; i < share.size(); ++i) {
    share[i] = plate.points[static_cast<std::size_t>(i)].x() < 80 ? 1 : 0.5;
  }
  for (const int alpha : {2, 3}) {
    const double nu = alpha - 1;
    const MaternDomain domain = WithLengths(MakeDomain(plate), share);
    const MaternField field(domain, alpha, MaternKappa(alpha, length_mm));
    const int left = NearestVertex(plate, {40, 80, 0}), right = NearestVertex(plate, {120, 80, 0});
    const Eigen::MatrixXd columns =
        field.Covariances(UnitColumns(std::ssize(plate.points), {left, right}), {});
    for (const auto& [column, center, length] :
         {std::tuple(0, left, length_mm), std::tuple(1, right, 0.5 * length_mm)}) {
      for (double r = 3; r <= 15; r += 3) {
        const double x = std::sqrt(2 * nu) / length * r;
        const double matern =
            std::pow(x, nu) * std::cyl_bessel_k(nu, x) / (std::pow(2.0, nu - 1) * std::tgamma(nu));
        const int at =
            NearestVertex(plate, plate.points[static_cast<std::size_t>(center)] + Vec3(0, r, 0));
        EXPECT_NEAR(columns(at, column) / columns(center, column), matern, 0.03)
            << alpha << " " << length << " " << r;
      }
    }
  }
}

TEST(MaternField, AtAStraightOpenBorderHasTwiceTheVariance) {
  const TriMesh plate = Plate(160, 80);
  const MaternDomain domain = MakeDomain(plate);
  const Eigen::SparseMatrix<double> local =
      MaternField(domain, 2, MaternKappa(2, 14)).LocalCovariances();
  const int center = NearestVertex(plate, {80, 80, 0}), border = NearestVertex(plate, {80, 0, 0});
  EXPECT_NEAR(local.coeff(border, border) / local.coeff(center, center), 2, 0.05);
}

// On a sphere of radius R the covariance is sum_l (2 l + 1) / (4 pi R^2) P_l(cos angle)
// (kappa^2 + l (l + 1) / R^2)^-alpha.
TEST(MaternField, OnASphereIsItsLegendreSeries) {
  const double radius = 50;
  const TriMesh sphere = SphereMesh({0, 0, 0}, radius, 60);
  const MaternDomain domain = MakeDomain(sphere);
  const int from = NearestVertex(sphere, {radius, 0, 0});
  for (const int alpha : {2, 3}) {
    const double kappa = MaternKappa(alpha, 40);
    const auto series = [&](double angle) {
      double sum = 0;
      for (unsigned l = 0; l < 400; ++l) {
        const double eigenvalue = l * (l + 1.0) / (radius * radius);
        sum += (2 * l + 1) / (4 * std::numbers::pi * radius * radius) *
               std::legendre(l, std::cos(angle)) / std::pow(kappa * kappa + eigenvalue, alpha);
      }
      return sum;
    };
    const Eigen::VectorXd column =
        MaternField(domain, alpha, kappa)
            .Covariances(UnitColumns(std::ssize(sphere.points), {from}), {});
    for (double angle = 0; angle <= 3.15; angle += std::numbers::pi / 12) {
      const int at = NearestVertex(sphere, radius * Vec3(std::cos(angle), std::sin(angle), 0));
      EXPECT_NEAR(column[at] / series(0), series(angle) / series(0), 0.01) << alpha << angle;
    }
  }
}

std::vector<double> Poles(int alpha) {
  std::vector<double> poles;
  for (int k = 0; k < 8; ++k) {
    const double kappa = MaternKappa(alpha, 5 * std::exp(5.0 * k / 7));
    poles.push_back(kappa * kappa);
  }
  return poles;
}

TEST_P(EveryAlpha, ReducedCorrelationsAreThoseOfTheField) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 60, 24);
  const MaternDomain domain = MakeDomain(sphere);
  const Eigen::MatrixXd weights = UnitColumns(std::ssize(sphere.points), {5, 130, 411, 600, 777});
  const ReducedMatern reduced(domain, weights, Poles(GetParam()), {});
  for (double length_mm = 6; length_mm < 500; length_mm *= 1.7) {
    const Eigen::MatrixXd exact =
        weights.transpose() * MaternField(domain, GetParam(), MaternKappa(GetParam(), length_mm))
                                  .Covariances(weights, {});
    const Eigen::VectorXd root = exact.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd off =
        reduced.At(GetParam(), length_mm).value - root.asDiagonal() * exact * root.asDiagonal();
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-4) << length_mm;
  }
}

TEST_P(EveryAlpha, DerivativeOfReducedCorrelationsEqualsItsNumericTwin) {
  const TriMesh sphere = SphereMesh({0, 0, 0}, 60, 24);
  const Eigen::MatrixXd weights = UnitColumns(std::ssize(sphere.points), {5, 130, 411, 600});
  const ReducedMatern reduced(MakeDomain(sphere), weights, Poles(GetParam()), {});
  constexpr double kStep = 1e-4;
  for (const double length_mm : {12.0, 60.0, 200.0}) {
    const Eigen::MatrixXd numeric = (reduced.At(GetParam(), length_mm * std::exp(kStep)).value -
                                     reduced.At(GetParam(), length_mm * std::exp(-kStep)).value) /
                                    (2 * kStep);
    const Eigen::MatrixXd exact = reduced.At(GetParam(), length_mm).by_log_length;
    EXPECT_LT((exact - numeric).cwiseAbs().maxCoeff(), 1e-6) << length_mm;
  }
}

}  // namespace
}  // namespace semblance::interp
