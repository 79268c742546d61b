// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "fitting/terms/term_cost.h"

namespace semblance::fitting {
namespace {

// One row over the dofs: the sum of coefficients times dofs, plus `fixed`, should be `equals`.
struct DofRow {
  std::vector<int> dofs;
  std::vector<double> coefficients;
  Vec3 fixed = Vec3::Zero();  // mm; of vertices that are not solved for
  Vec3 equals = Vec3::Zero();
};

DofRow MakeDofRow(const LinearRow& row, const LevelView& view, std::size_t index) {
  DofRow result;
  result.equals = Vec3(row.equals[0], row.equals[1], row.equals[2]);
  if (!view.finer_in_rows.empty()) {
    result.fixed = view.finer_in_rows[index];
  }
  for (const auto& [u, v, du, dv, c] : row.at) {
    const DofStencil stencil = view.StencilAt({u, v}, {static_cast<int>(du), static_cast<int>(dv)});
    for (int k = 0; k < stencil.count; ++k) {
      result.dofs.push_back(stencil.index[k]);
      result.coefficients.push_back(c * stencil.weight[k]);
    }
    result.fixed += c * stencil.fixed;
  }
  return result;
}

// Adds up the coefficients of a dof that occurs several times.
void JoinRepeated(DofRow& row) {
  std::vector<int> dofs = row.dofs;
  std::ranges::sort(dofs);
  dofs.erase(std::unique(dofs.begin(), dofs.end()), dofs.end());
  std::vector<double> sums(dofs.size(), 0.0);
  for (std::size_t k = 0; k < row.dofs.size(); ++k) {
    sums[std::ranges::lower_bound(dofs, row.dofs[k]) - dofs.begin()] += row.coefficients[k];
  }
  row.dofs = std::move(dofs);
  row.coefficients = std::move(sums);
}

}  // namespace

void AddRows(const RowsTerm& term, const LevelView& view, RowSink& sink) {
  const double factor = std::sqrt(term.weight / static_cast<double>(term.rows.size()));
  for (std::size_t k = 0; k < term.rows.size(); ++k) {
    DofRow row = MakeDofRow(term.rows[k], view, k);
    JoinRepeated(row);
    const Eigen::Map<const Eigen::RowVectorXd> coefficients(
        row.coefficients.data(), static_cast<Eigen::Index>(row.coefficients.size()));
    sink.Add(std::make_shared<const Eigen::MatrixXd>(factor * coefficients),
             factor * (row.equals - row.fixed).transpose(), row.dofs);
  }
}

double TermCost(const RowsTerm& term, const LevelView& view, const ControlNet& net) {
  double sum = 0;
  for (std::size_t k = 0; k < term.rows.size(); ++k) {
    const DofRow row = MakeDofRow(term.rows[k], view, k);
    Vec3 off = row.fixed - row.equals;
    for (std::size_t j = 0; j < row.dofs.size(); ++j) {
      off += row.coefficients[j] * net.vertices[row.dofs[j]];
    }
    sum += off.squaredNorm();
  }
  return term.weight * sum / static_cast<double>(term.rows.size());
}

}  // namespace semblance::fitting
