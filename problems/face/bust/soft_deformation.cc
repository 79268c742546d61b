// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/bust/soft_deformation.h"

#include <cmath>

#include "interp/on_surface/mesh_laplacian.h"
#include "interp/on_surface/mesh_solver.h"

namespace semblance::problems {

SoftDeformation::SoftDeformation(const TriMesh& mesh, const DeformOptions& options)
    : points_(mesh.points) {
  const MeshLaplacian laplacian = BuildLaplacian(mesh);
  area_mm2_ = laplacian.area_mm2;
  const double stiffness = std::pow(options.detail_mm, 4);
  const Eigen::SparseMatrix<double>& k = laplacian.stiffness;
  const Eigen::SparseMatrix<double> per_area = area_mm2_.cwiseInverse().asDiagonal() * k;
  bending_ = k * per_area;
  bending_ *= stiffness;
  bending_ += k * (stiffness / (options.level_out_mm * options.level_out_mm));
  bending_.diagonal() += area_mm2_ * (stiffness / std::pow(options.fade_mm, 4));
}

std::vector<Vec3> SoftDeformation::Follow(std::span<const SoftTarget> targets) const {
  if (targets.empty()) {
    return points_;
  }
  const auto n = static_cast<Eigen::Index>(points_.size());
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, 3);
  for (const SoftTarget& target : targets) {
    const double weight = target.weight * area_mm2_[target.vertex];
    diagonal[target.vertex] += weight;
    right.row(target.vertex) += weight * (target.position - points_[target.vertex]).transpose();
  }
  Eigen::SparseMatrix<double> matrix = bending_;
  matrix.diagonal() += diagonal;
  const Eigen::MatrixXd displacement = MeshSolver(points_, matrix).Solve(right);
  std::vector<Vec3> points;
  for (Eigen::Index v = 0; v < n; ++v) {
    points.push_back(points_[v] + displacement.row(v).transpose());
  }
  return points;
}

std::vector<std::int32_t> TurnedOver(const TriMesh& before, const TriMesh& after,
                                     const Mat3& rotation) {
  std::vector<std::int32_t> turned;
  for (std::size_t t = 0; t < before.triangles.size(); ++t) {
    const Triangle& triangle = before.triangles[t];
    const Vec3 expected = rotation * TriangleAreaVector(before, triangle);
    if (expected.dot(TriangleAreaVector(after, triangle)) < 0) {
      turned.push_back(static_cast<std::int32_t>(t));
    }
  }
  return turned;
}

}  // namespace semblance::problems
