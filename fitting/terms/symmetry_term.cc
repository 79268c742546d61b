// SPDX-License-Identifier: GPL-3.0-or-later
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

int MirrorOf(const PatchGrid& grid, int vertex) {
  const int columns = grid.Columns(), i = vertex % columns;
  const int mirrored = grid.periodic_u ? (columns + 2 - i) % columns : columns - 1 - i;
  return vertex - i + mirrored;
}

struct Mirror {
  Vec3 point = Vec3::Zero();  // of the plane
  Mat3 reflection = Mat3::Identity();
};

// The reflection that takes the template's vertices nearest to their mirrors: its normal n makes
// n . sum_k x_k y_k^T n least, x and y being a vertex and its mirror from their common centre.
Mirror MirrorOf(const LevelView& view) {
  const std::vector<Vec3>& rest = view.rest.vertices;
  Mirror mirror;
  for (const Vec3& v : rest) {
    mirror.point += v / static_cast<double>(rest.size());
  }
  Mat3 sum = Mat3::Zero();
  for (std::size_t k = 0; k < rest.size(); ++k) {
    const Vec3& twin = rest[MirrorOf(view.grid, static_cast<int>(k))];
    sum += (rest[k] - mirror.point) * (twin - mirror.point).transpose();
  }
  const Mat3 symmetric = sum + sum.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(symmetric);
  const Vec3 normal = eigen.eigenvectors().col(0);
  mirror.reflection -= 2 * normal * normal.transpose();
  return mirror;
}

// Where a vertex's f is zero.
Vec3 Origin(const SymmetryTerm& term, const LevelView& view, const Mirror& mirror, int vertex) {
  return term.of == SmoothnessOf::kDisplacement ? view.rest.vertices[vertex] : mirror.point;
}

}  // namespace

// Both vertices of a pair have the same misfit, so one stands for both.
void AddResiduals(const SymmetryTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  const Mirror mirror = MirrorOf(view);
  const double scale = term.weight / static_cast<double>(net.vertices.size());
  for (int k = 0; k < static_cast<int>(net.vertices.size()); ++k) {
    const int twin = MirrorOf(view.grid, k);
    if (twin < k) {
      continue;
    }
    const double factor = std::sqrt(twin == k ? scale : 2 * scale);
    Eigen::MatrixXd a(3, 6);
    a << factor * Mat3::Identity(), -factor * mirror.reflection;
    Eigen::VectorXd origins(6);
    origins << Origin(term, view, mirror, k), Origin(term, view, mirror, twin);
    AddCoupledResidual(a, a * origins, std::array{k, twin}, net, problem);
  }
}

double TermCost(const SymmetryTerm& term, const LevelView& view, const ControlNet& net) {
  const Mirror mirror = MirrorOf(view);
  double sum = 0;
  for (int k = 0; k < static_cast<int>(net.vertices.size()); ++k) {
    const int twin = MirrorOf(view.grid, k);
    const Vec3 f = net.vertices[k] - Origin(term, view, mirror, k);
    const Vec3 g = net.vertices[twin] - Origin(term, view, mirror, twin);
    sum += (f - mirror.reflection * g).squaredNorm();
  }
  return term.weight * sum / static_cast<double>(net.vertices.size());
}

}  // namespace semblance
