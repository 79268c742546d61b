// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/normal_equations.h"

#include <algorithm>
#include <set>
#include <utility>

namespace semblance {
namespace {

// Vertices that share a patch with vertex (i, j) and do not come before it, ascending.
std::vector<int> Neighbours(const PatchGrid& grid, int i, int j) {
  std::set<int> found;
  for (int b = std::max(j - 3, 0); b <= std::min(j + 3, grid.Rows() - 1); ++b) {
    for (int a = i - 3; a <= i + 3; ++a) {
      const int n = grid.Columns();
      if (grid.periodic_u || (a >= 0 && a < n)) {
        found.insert(((a % n) + n) % n + n * b);
      }
    }
  }
  return {found.lower_bound(i + grid.Columns() * j), found.end()};
}

SparseMatrix Pattern(const PatchGrid& grid) {
  const int count = grid.Columns() * grid.Rows();
  SparseMatrix pattern(count, count);
  pattern.reserve(Eigen::VectorXi::Constant(count, 25));
  for (int column = 0; column < count; ++column) {
    for (const int row : Neighbours(grid, column % grid.Columns(), column / grid.Columns())) {
      pattern.insert(row, column) = 0;
    }
  }
  pattern.makeCompressed();
  return pattern;
}

}  // namespace

NormalMatrix::NormalMatrix(const PatchGrid& grid) : patches_(Pattern(grid)) {}

void NormalMatrix::AddEntry(int row, int column, double value) {
  const int* const inner = patches_.innerIndexPtr();
  const int* const end = inner + patches_.outerIndexPtr()[column + 1];
  const int* const at = std::lower_bound(inner + patches_.outerIndexPtr()[column], end, row);
  if (at != end && *at == row) {
    patches_.valuePtr()[at - inner] += value;
  } else {
    others_.emplace_back(row, column, value);
  }
}

void NormalMatrix::Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 /*b*/,
                       std::span<const int> vertices) {
  if (a != last_) {
    gram_.noalias() = a->transpose() * *a;
    last_ = std::move(a);
  }
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    for (std::size_t l = 0; l < vertices.size(); ++l) {
      if (vertices[k] >= vertices[l] && gram_(k, l) != 0) {
        AddEntry(vertices[k], vertices[l], gram_(k, l));
      }
    }
  }
}

SparseMatrix NormalMatrix::Lower() const {
  if (others_.empty()) {
    return patches_;
  }
  SparseMatrix others(patches_.rows(), patches_.cols());
  others.setFromTriplets(others_.begin(), others_.end());
  return patches_ + others;
}

NormalResidual::NormalResidual(const ControlNet& net)
    : net_(net), sum_(Eigen::MatrixX3d::Zero(net.vertices.size(), 3)) {}

void NormalResidual::Add(std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                         std::span<const int> vertices) {
  Eigen::MatrixX3d x(vertices.size(), 3);
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    x.row(k) = net_.vertices[vertices[k]];
  }
  b.noalias() -= *a * x;
  x.noalias() = a->transpose() * b;
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    sum_.row(vertices[k]) += x.row(k);
  }
}

}  // namespace semblance
