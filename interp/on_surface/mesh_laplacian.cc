// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/mesh_laplacian.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace semblance::interp {
namespace {

constexpr double kMaxCotangent = 100;    // an angle of 0.6 degrees
constexpr double kMinEdgeWeight = 1e-4;  // sum of an edge's two half cotangents; 0 would disconnect
constexpr double kMinAreaShare = 1e-2;   // of the mean area

// The cotangent of the angle at the corner `at`.
double Cotangent(const Vec3& at, const Vec3& b, const Vec3& c) {
  const Vec3 to_b = b - at, to_c = c - at;
  const double sine = to_b.cross(to_c).norm(), cosine = to_b.dot(to_c);
  if (std::abs(cosine) >= kMaxCotangent * sine) {
    return cosine < 0 ? -kMaxCotangent : kMaxCotangent;
  }
  return cosine / sine;
}

using Entries = std::vector<Eigen::Triplet<double>>;

// The sum of the half cotangents of an edge's triangles, per pair of vertices.
Eigen::SparseMatrix<double> EdgeWeights(const TriMesh& mesh) {
  Entries entries;
  entries.reserve(6 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const int at = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      if (at == b || b == c || c == at) {
        continue;
      }
      const double half = Cotangent(mesh.points[at], mesh.points[b], mesh.points[c]) / 2;
      entries.emplace_back(b, c, half);
      entries.emplace_back(c, b, half);
    }
  }
  const auto n = static_cast<Eigen::Index>(mesh.points.size());
  Eigen::SparseMatrix<double> weights(n, n);
  weights.setFromTriplets(entries.begin(), entries.end());
  return weights;
}

// The areas of vertices, > 0 also for a vertex without a triangle.
Eigen::VectorXd PositiveAreas(const TriMesh& mesh) {
  const std::vector<double> areas = VertexAreas(mesh);
  const auto count = static_cast<double>(std::max<std::size_t>(areas.size(), 1));
  const double mean = std::accumulate(areas.begin(), areas.end(), 0.0) / count;
  const double least = mean > 0 ? kMinAreaShare * mean : 1;
  Eigen::VectorXd positive(static_cast<Eigen::Index>(areas.size()));
  for (Eigen::Index i = 0; i < positive.size(); ++i) {
    positive[i] = std::max(areas[i], least);
  }
  return positive;
}

}  // namespace

MeshLaplacian BuildLaplacian(const TriMesh& mesh) {
  MeshLaplacian laplacian;
  Eigen::SparseMatrix<double>& matrix = laplacian.stiffness;
  matrix = EdgeWeights(mesh);
  Entries diagonal;
  for (int column = 0; column < matrix.outerSize(); ++column) {
    double sum = 0;
    for (Eigen::SparseMatrix<double>::InnerIterator it(matrix, column); it; ++it) {
      it.valueRef() = -std::max(it.value(), kMinEdgeWeight);
      sum -= it.value();
    }
    diagonal.emplace_back(column, column, sum);
  }
  Eigen::SparseMatrix<double> sums(matrix.rows(), matrix.cols());
  sums.setFromTriplets(diagonal.begin(), diagonal.end());
  matrix += sums;
  laplacian.area_mm2 = PositiveAreas(mesh);
  return laplacian;
}

std::vector<int> LabelPieces(const Eigen::SparseMatrix<double>& stiffness) {
  std::vector<int> piece(static_cast<std::size_t>(stiffness.cols()), -1);
  int count = 0;
  std::vector<int> open;
  for (int first = 0; first < stiffness.cols(); ++first) {
    if (piece[first] >= 0) {
      continue;
    }
    piece[first] = count;
    open.push_back(first);
    while (!open.empty()) {
      const int at = open.back();
      open.pop_back();
      for (Eigen::SparseMatrix<double>::InnerIterator it(stiffness, at); it; ++it) {
        if (piece[it.row()] < 0) {
          piece[it.row()] = count;
          open.push_back(static_cast<int>(it.row()));
        }
      }
    }
    ++count;
  }
  return piece;
}

}  // namespace semblance::interp
