// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/bust/soft_deformation.h"

#include <cmath>

#include "interp/on_surface/mesh_laplacian.h"
#include "interp/on_surface/mesh_solver.h"

namespace semblance {

std::vector<Vec3> Deform(const TriMesh& mesh, std::span<const SoftTarget> targets,
                         const DeformOptions& options) {
  const auto n = static_cast<Eigen::Index>(mesh.points.size());
  if (targets.empty()) {
    return mesh.points;
  }
  const MeshLaplacian laplacian = BuildLaplacian(mesh);
  const Eigen::VectorXd& area = laplacian.area_mm2;
  Eigen::VectorXd diagonal = area * std::pow(options.detail_mm / options.fade_mm, 4);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n, 3);
  for (const SoftTarget& target : targets) {
    const double weight = target.weight * area[target.vertex];
    diagonal[target.vertex] += weight;
    right.row(target.vertex) += weight * (target.position - mesh.points[target.vertex]).transpose();
  }
  const double stiffness = std::pow(options.detail_mm, 4);
  const Eigen::SparseMatrix<double>& k = laplacian.stiffness;
  const Eigen::SparseMatrix<double> per_area = area.cwiseInverse().asDiagonal() * k;
  Eigen::SparseMatrix<double> matrix = k * per_area;
  matrix *= stiffness;
  matrix += k * (stiffness / (options.calm_mm * options.calm_mm));
  matrix.diagonal() += diagonal;
  const Eigen::MatrixXd displacement = MeshSolver(mesh.points, matrix).Solve(right);
  std::vector<Vec3> points;
  for (Eigen::Index v = 0; v < n; ++v) {
    points.push_back(mesh.points[v] + displacement.row(v).transpose());
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

}  // namespace semblance
