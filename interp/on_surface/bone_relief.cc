// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/bone_relief.h"

#include "interp/on_surface/matern_field.h"

namespace semblance {

Eigen::MatrixXd BoneRelief(const TriMesh& mesh, std::span<const double> scales_mm) {
  const std::vector<Vec3> normals = VertexNormals(mesh);
  const MeshLaplacian laplacian = BuildLaplacian(mesh);
  const auto count = std::ssize(mesh.points);
  Eigen::MatrixXd points(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    points.row(i) = mesh.points[static_cast<std::size_t>(i)].transpose();
  }
  Eigen::MatrixXd relief(std::ssize(scales_mm), count);
  for (std::size_t k = 0; k < scales_mm.size(); ++k) {
    const double shift = 1 / (scales_mm[k] * scales_mm[k]);
    const MeshSolver solver(mesh.points, ShiftedStiffness(laplacian, shift));
    const Eigen::MatrixXd smooth = solver.Solve(shift * (laplacian.area_mm2.asDiagonal() * points));
    for (Eigen::Index i = 0; i < count; ++i) {
      relief(static_cast<Eigen::Index>(k), i) =
          (smooth.row(i) - points.row(i)).dot(normals[static_cast<std::size_t>(i)]);
    }
  }
  return relief;
}

}  // namespace semblance
