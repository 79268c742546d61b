// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/population/depth_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace semblance::problems {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxModeRounds = 200;
constexpr double kModeTolerance_mm = 1e-6;  // change of filled depths at which the rounds end

struct Components {
  VectorXd variances;  // descending
  MatrixXd scores;     // subjects x modes, of unit variance
  MatrixXd modes;      // cells x modes, at one standard deviation
};

// The components of centred rows, from the small matrix of subjects by subjects.
Components FindComponents(const MatrixXd& rows, Index count) {
  const double freedom = static_cast<double>(rows.rows() - 1);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(rows * rows.transpose() / freedom);
  Components found{VectorXd(count), MatrixXd(rows.rows(), count), MatrixXd(rows.cols(), count)};
  for (Index k = 0; k < count; ++k) {
    const Index from = rows.rows() - 1 - k;
    found.variances[k] = std::max(0.0, solver.eigenvalues()[from]);
    found.scores.col(k) = std::sqrt(freedom) * solver.eigenvectors().col(from);
    found.modes.col(k) = rows.transpose() * found.scores.col(k) / freedom;
    if (found.modes.col(k).sum() < 0) {
      found.modes.col(k) *= -1;
      found.scores.col(k) *= -1;
    }
  }
  return found;
}

// The depths of the used cells, subjects x cells; NaN if missing.
MatrixXd UsedDepths(std::span<const DenseDepths> subjects, const std::vector<bool>& used) {
  MatrixXd depths(std::ssize(subjects), std::ranges::count(used, true));
  for (Index row = 0; row < depths.rows(); ++row) {
    Index column = 0;
    for (std::size_t cell = 0; cell < used.size(); ++cell) {
      if (used[cell]) {
        depths(row, column++) = subjects[row].depth_mm[cell];
      }
    }
  }
  return depths;
}

// Alternately finds the components and fills missing depths from them, until the depths rest.
Components FillAndFind(const MatrixXd& depths, const VectorXd& start, Index count) {
  MatrixXd full = depths;
  for (Index row = 0; row < full.rows(); ++row) {
    for (Index column = 0; column < full.cols(); ++column) {
      full(row, column) = std::isfinite(depths(row, column)) ? depths(row, column) : start[column];
    }
  }
  Components found;
  for (int round = 0; round < kMaxModeRounds; ++round) {
    const Eigen::RowVectorXd mean = full.colwise().mean();
    found = FindComponents(full.rowwise() - mean, count);
    double moved = 0;
    const MatrixXd predicted = (found.scores * found.modes.transpose()).rowwise() + mean;
    for (Index row = 0; row < full.rows(); ++row) {
      for (Index column = 0; column < full.cols(); ++column) {
        if (!std::isfinite(depths(row, column))) {
          moved = std::max(moved, std::abs(predicted(row, column) - full(row, column)));
          full(row, column) = predicted(row, column);
        }
      }
    }
    if (moved < kModeTolerance_mm) {
      break;
    }
  }
  const MatrixXd off = full.rowwise() - full.colwise().mean();
  found.variances /= std::max(1e-300, off.squaredNorm() / static_cast<double>(full.rows() - 1));
  return found;
}

// Computes mean, deviation and position of one cell.
void Summarise(std::span<const DenseDepths> subjects, std::size_t cell, DepthModes& result) {
  double sum = 0, squares = 0;
  Vec3 place = Vec3::Zero();
  int n = 0;
  for (const DenseDepths& subject : subjects) {
    if (std::isfinite(subject.depth_mm[cell])) {
      sum += subject.depth_mm[cell];
      place += subject.bone[cell];
      ++n;
    }
  }
  result.n[cell] = n;
  result.mean_mm[cell] = n > 0 ? sum / n : kNaN;
  result.bone[cell] = n > 0 ? Vec3(place / n) : Vec3(Vec3::Constant(kNaN));
  for (const DenseDepths& subject : subjects) {
    const double off = subject.depth_mm[cell] - result.mean_mm[cell];
    squares += std::isfinite(off) ? off * off : 0;
  }
  result.sd_mm[cell] = n > 1 ? std::sqrt(squares / (n - 1)) : kNaN;
}

void StoreModes(const Components& found, DepthModes& result) {
  result.scores = found.scores;
  for (Index k = 0; k < found.modes.cols(); ++k) {
    result.share.push_back(found.variances[k]);
    std::vector<double>& mode = result.modes_mm.emplace_back(result.used.size(), kNaN);
    Index column = 0;
    for (std::size_t cell = 0; cell < mode.size(); ++cell) {
      if (result.used[cell]) {
        mode[cell] = found.modes(column++, k);
      }
    }
  }
}

}  // namespace

DepthModes FindModes(std::span<const DenseDepths> subjects, const DenseOptions& options) {
  DepthModes result;
  result.columns = options.columns;
  result.rows = options.rows;
  const std::size_t cells = static_cast<std::size_t>(options.columns) * options.rows;
  result.n.resize(cells);
  result.mean_mm.resize(cells);
  result.sd_mm.resize(cells);
  result.bone.resize(cells);
  result.used.resize(cells);
  const double least = std::max(2.0, options.least_share * static_cast<double>(subjects.size()));
  for (std::size_t cell = 0; cell < cells; ++cell) {
    Summarise(subjects, cell, result);
    result.used[cell] = result.n[cell] >= least;
  }
  const MatrixXd depths = UsedDepths(subjects, result.used);
  const Index count = std::min<Index>({options.modes, std::ssize(subjects) - 1, depths.cols()});
  if (count < 1) {
    return result;
  }
  VectorXd means(depths.cols());
  Index column = 0;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (result.used[cell]) {
      means[column++] = result.mean_mm[cell];
    }
  }
  StoreModes(FillAndFind(depths, means, count), result);
  return result;
}

DenseMesh MakeDenseMesh(const DepthModes& dense) {
  DenseMesh mesh;
  std::vector<std::int32_t> vertex(dense.n.size(), -1);
  for (std::size_t cell = 0; cell < vertex.size(); ++cell) {
    if (dense.n[cell] > 0) {
      vertex[cell] = static_cast<std::int32_t>(mesh.cells.size());
      mesh.cells.push_back(cell);
      mesh.mesh.points.push_back(dense.bone[cell]);
    }
  }
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    if (vertex[a] >= 0 && vertex[b] >= 0 && vertex[c] >= 0) {
      mesh.mesh.triangles.push_back({vertex[a], vertex[b], vertex[c]});
    }
  };
  for (int j = 0; j + 1 < dense.rows; ++j) {
    for (int i = 0; i + 1 < dense.columns; ++i) {
      const std::size_t a = i + static_cast<std::size_t>(dense.columns) * j, b = a + 1,
                        c = a + dense.columns, d = c + 1;
      add(a, b, d);
      add(a, d, c);
    }
  }
  return mesh;
}

std::vector<double> OnVertices(const DenseMesh& mesh, const std::vector<double>& by_cell) {
  std::vector<double> values;
  for (const std::size_t cell : mesh.cells) {
    values.push_back(by_cell[cell]);
  }
  return values;
}

}  // namespace semblance::problems
