// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/subspace.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "surfaces/hspline/bspline_basis.h"

namespace semblance {
namespace {

// Knot insertion as a matrix: vertices of `level` x vertices of the coarser one.
SparseMatrix RefinementOf(const HSplineShape& shape, int level) {
  const int columns = shape.Columns(level), rows = shape.Rows(level);
  const int coarse_columns = shape.Columns(level - 1), coarse_rows = shape.Rows(level - 1);
  std::vector<Eigen::Triplet<double>> entries;
  for (int j = 0; j < rows; ++j) {
    const RefinementRow v = RefineRow(j);
    for (int i = 0; i < columns; ++i) {
      const RefinementRow u = RefineRow(i);
      for (int k = 0; k < 9; ++k) {
        const double weight = u.weight[k % 3] * v.weight[k / 3];
        if (weight > 0) {
          entries.emplace_back(
              i + columns * j,
              shape.Column(level - 1, u.index[k % 3]) + coarse_columns * v.index[k / 3], weight);
        }
      }
    }
  }
  SparseMatrix refinement(columns * rows, coarse_columns * coarse_rows);
  refinement.setFromTriplets(entries.begin(), entries.end());
  return refinement;
}

std::vector<int> EditedOn(const HSplineSurface& surface, int level) {
  std::vector<int> edited;
  for (const auto& [vertex, offset] : surface.Offsets()) {
    if (vertex.level == level) {
      edited.push_back(vertex.i + surface.shape().Columns(level) * vertex.j);
    }
  }
  return edited;
}

// The columns of a and, beside them, a unit column for each of `rows`.
SparseMatrix WithUnits(const SparseMatrix& a, const std::vector<int>& rows) {
  const auto more = static_cast<Eigen::Index>(rows.size());
  SparseMatrix result(a.rows(), a.cols() + more);
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index column = 0; column < a.cols(); ++column) {
    for (SparseMatrix::InnerIterator it(a, column); it; ++it) {
      entries.emplace_back(static_cast<int>(it.row()), static_cast<int>(column), it.value());
    }
  }
  for (Eigen::Index k = 0; k < more; ++k) {
    entries.emplace_back(rows[k], static_cast<int>(a.cols() + k), 1);
  }
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

SparseMatrix Within(const SparseMatrix& lower, const SparseMatrix& space) {
  if (space.rows() == 0) {
    return lower;
  }
  const SparseMatrix whole = lower.selfadjointView<Eigen::Lower>();
  const SparseMatrix moved = whole * space;
  const SparseMatrix reduced = space.transpose() * moved;
  return reduced.triangularView<Eigen::Lower>();
}

}  // namespace

SparseMatrix SubspaceBasis(const HSplineSurface& surface, int level) {
  const HSplineShape& shape = surface.shape();
  const std::size_t finest = EditedOn(surface, level).size();
  const std::size_t all = static_cast<std::size_t>(shape.Columns(level)) * shape.Rows(level);
  if (level == 0 || finest == 0 || finest == all) {
    return {};
  }
  SparseMatrix space(shape.Columns(0) * shape.Rows(0), shape.Columns(0) * shape.Rows(0));
  space.setIdentity();
  for (int l = 1; l <= level; ++l) {
    space = WithUnits(RefinementOf(shape, l) * space, EditedOn(surface, l));
  }
  return space;
}

SubspaceSolver::SubspaceSolver(const SparseMatrix& lower, SparseMatrix space)
    : space_(std::move(space)) {
  const SparseMatrix within = Within(lower, space_);
  factor_ =
      std::make_unique<SparseFactor>(within, 1e-11 * std::max(within.diagonal().maxCoeff(), 1e-12));
}

Eigen::MatrixXd SubspaceSolver::Solve(const Eigen::MatrixXd& right) const {
  if (space_.rows() == 0) {
    return factor_->Solve(right);
  }
  return space_ * factor_->Solve(space_.transpose() * right);
}

}  // namespace semblance
