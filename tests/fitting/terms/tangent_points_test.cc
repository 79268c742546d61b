// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the normal equations for a direct factor with the rows for Ceres.
#include "fitting/terms/tangent_points.h"

#include <ceres/crs_matrix.h>
#include <ceres/problem.h>
#include <gtest/gtest.h>

#include <vector>

#include "fitting/space/point_cloud.h"
#include "fitting/terms/term_cost.h"
#include "tests/testing/level_views.h"
#include "tests/testing/scattered_data.h"

namespace semblance::fitting {
namespace {

// J^T J and J^T r over all coordinates of the dofs.
struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
};

Normal ByRows(const TangentPointTerm& term, const LevelView& view, ControlNet net) {
  ceres::Problem problem;
  AddResiduals(term, view, net, problem);
  ceres::Problem::EvaluateOptions options;
  std::vector<int> columns;
  for (std::size_t d = 0; d < net.vertices.size(); ++d) {
    if (problem.HasParameterBlock(net.vertices[d].data())) {
      options.parameter_blocks.push_back(net.vertices[d].data());
      for (int c = 0; c < 3; ++c) {
        columns.push_back(static_cast<int>(3 * d) + c);
      }
    }
  }
  std::vector<double> gradient;
  ceres::CRSMatrix crs;
  problem.Evaluate(options, nullptr, nullptr, &gradient, &crs);
  const auto size = static_cast<Eigen::Index>(3 * net.vertices.size());
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(crs.num_rows, size);
  Normal normal{{}, Eigen::VectorXd::Zero(size)};
  for (int row = 0; row < crs.num_rows; ++row) {
    for (int k = crs.rows[row]; k < crs.rows[row + 1]; ++k) {
      jacobian(row, columns[crs.cols[k]]) = crs.values[k];
    }
  }
  for (std::size_t k = 0; k < columns.size(); ++k) {
    normal.gradient[columns[k]] = gradient[k];
  }
  normal.matrix = jacobian.transpose() * jacobian;
  return normal;
}

Normal BySums(const TangentPointTerm& term, const LevelView& view, const ControlNet& net) {
  const auto size = static_cast<Eigen::Index>(3 * net.vertices.size());
  Normal normal{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  const TangentSums sums(term, view);
  sums.ForEachElement([&](std::span<const int> dofs, const Eigen::MatrixXd& part) {
    for (std::size_t a = 0; a < dofs.size(); ++a) {
      for (std::size_t b = 0; b < dofs.size(); ++b) {
        normal.matrix.block<3, 3>(3 * dofs[a], 3 * dofs[b]) +=
            part.block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
      }
    }
  });
  Eigen::VectorXd down = Eigen::VectorXd::Zero(size);
  sums.AddDownhill(net, down);
  normal.gradient = -down;
  return normal;
}

ControlNet Shaken(ControlNet net) {
  Random random(11);
  for (Vec3& vertex : net.vertices) {
    vertex += random.InBox(-3, 3);
  }
  return net;
}

void ExpectTheSame(const LevelView& view) {
  for (const double tangential : {0.0, 0.1, 1.0}) {
    const TangentPointTerm term{.weight = 2, .tangential = tangential};
    const ControlNet net = Shaken(view.start);
    const Normal rows = ByRows(term, view, net), sums = BySums(term, view, net);
    EXPECT_LT((rows.matrix - sums.matrix).norm(), 1e-12 * rows.matrix.norm());
    EXPECT_LT((rows.gradient - sums.gradient).norm(), 1e-12 * rows.gradient.norm());
  }
}

TEST(TangentSums, OfALevelEqualThoseOfItsRows) { ExpectTheSame(testing::NoisyView()); }

// Finer vertices in one corner make elements whose dofs differ from their sixteen vertices. The
// second surface has no normal, so its points are held in every direction.
TEST(TangentSums, OfAllLevelsEqualThoseOfTheirRows) {
  const HSplineShape shape{.patches_u = 4, .patches_v = 3, .max_level = 3};
  for (const bool has_normal : {true, false}) {
    ControlNet net = testing::Sheet(4, 3, 5, 1);
    for (Vec3& vertex : net.vertices) {
      vertex = has_normal ? vertex : Vec3(vertex.x(), 0, 0);
    }
    const HSplineSurface start(shape, net);
    FitTarget target =
        testing::Scattered([&](const Vec2& uv) { return start.Point(uv); }, 500, 2, 6);
    const PointCloud cloud(shape, target);
    HierarchicalSplineSpace space(start, start, cloud);
    space.Edit(std::vector<VertexId>{{1, 1, 1}, {1, 2, 1}, {2, 3, 3}, {3, 7, 7}});
    const LevelView view = MakeSpaceView(space, cloud, target, {130, 80});
    int mixed = 0;
    for (int e = 0; e < view.elements(); ++e) {
      mixed += view.Element(e).IsIdentity() ? 0 : 1;
    }
    EXPECT_GT(mixed, 4);
    ExpectTheSame(view);
  }
}

}  // namespace
}  // namespace semblance::fitting
