// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/subspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <map>
#include <optional>

#include "tests/testing/scattered_data.h"

namespace semblance {
namespace {

// Finer in one corner only, offsets in world axes, so that the whole is linear.
HSplineSurface FinerInPlaces(Closure closure) {
  const HSplineShape shape{.patches_u = 4,
                           .patches_v = 4,
                           .max_level = 2,
                           .closure = closure,
                           .reference = OffsetReference::kWorld};
  HSplineSurface surface = testing::PlainStart(shape);
  std::map<VertexId, std::optional<Vec3>> offsets;
  for (int k = 0; k < 25; ++k) {
    offsets[{1, k % 5, k / 5}] = Vec3(0, 0, 0.01 * k);
    offsets[{2, 2 + k % 5, 2 + k / 5}] = Vec3(0, 0, -0.01 * k);
  }
  surface.SetOffsets(offsets);
  return surface;
}

Eigen::VectorXd MovedX(const HSplineSurface& before, const HSplineSurface& after) {
  const ControlNet from = before.Net(2), to = after.Net(2);
  Eigen::VectorXd moved(static_cast<Eigen::Index>(from.vertices.size()));
  for (std::size_t k = 0; k < from.vertices.size(); ++k) {
    moved[static_cast<Eigen::Index>(k)] = to.vertices[k].x() - from.vertices[k].x();
  }
  return moved;
}

// Whatever vertex moves, and with it the detail on it: the finest net stays within the space; and
// there are as many independent moves as it has columns.
TEST(Subspace, HoldsWhatTheSurfaceCanDo) {
  for (const Closure closure : {Closure::kOpen, Closure::kPeriodicU}) {
    const HSplineSurface surface = FinerInPlaces(closure);
    const Eigen::MatrixXd space = SubspaceBasis(surface, 2);
    const ControlNet net = surface.Net(0);
    EXPECT_EQ(space.cols(), static_cast<Eigen::Index>(net.vertices.size() + 50));
    Eigen::MatrixXd moves(space.rows(), space.cols());
    Eigen::Index column = 0;
    for (std::size_t k = 0; k < net.vertices.size(); ++k) {
      HSplineSurface moved = surface;
      ControlNet coarse = net;
      coarse.vertices[k].x() += 1;
      moved.SetNet(0, coarse);
      moves.col(column++) = MovedX(surface, moved);
    }
    for (const auto& [vertex, offset] : surface.Offsets()) {
      HSplineSurface moved = surface;
      moved.SetOffset(vertex, offset + Vec3(1, 0, 0));
      moves.col(column++) = MovedX(surface, moved);
    }
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(space);
    EXPECT_LT((space * qr.solve(moves) - moves).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_EQ(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(moves).rank(), qr.rank());
  }
}

TEST(Subspace, IsAllNetsWhereEveryVertexIsEditedOrNone) {
  const HSplineSurface plain =
      testing::PlainStart({.patches_u = 4, .patches_v = 4, .max_level = 1});
  EXPECT_EQ(SubspaceBasis(plain, 0).rows(), 0);
  EXPECT_EQ(SubspaceBasis(plain, 1).rows(), 0);
  HSplineSurface whole = plain;
  ControlNet net = whole.Net(1);
  for (Vec3& vertex : net.vertices) {
    vertex.z() += 1 + vertex.x() * vertex.x();
  }
  whole.SetNet(1, net);
  EXPECT_EQ(SubspaceBasis(whole, 1).rows(), 0);
}

// Dense linear algebra.
TEST(Subspace, SolvesWithinTheSpace) {
  const HSplineSurface surface = FinerInPlaces(Closure::kOpen);
  const SparseMatrix space = SubspaceBasis(surface, 2);
  const Eigen::Index n = space.rows();
  const Eigen::MatrixXd normal =
      Eigen::MatrixXd::Identity(n, n) + 0.1 * Eigen::MatrixXd::Ones(n, n);
  const Eigen::MatrixXd dense = space, right = Eigen::VectorXd::LinSpaced(n, -1, 2);
  const Eigen::MatrixXd lower = normal.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd expected =
      dense * (dense.transpose() * normal * dense).ldlt().solve(dense.transpose() * right);
  EXPECT_LT((SubspaceSolver(lower.sparseView(), space).Solve(right) - expected).norm(),
            1e-6 * expected.norm());
}

}  // namespace
}  // namespace semblance
