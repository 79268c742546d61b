// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/on_surface/mesh_spline.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "interp/on_surface/mesh_laplacian.h"
#include "interp/on_surface/mesh_solver.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

constexpr double kMinSoftness = 1e-12;  // keeps two dowels at one vertex from making the equations
                                        // singular

constexpr Eigen::Index kMaxHeld = 64;  // functions in memory at a time: 8 bytes per vertex each
constexpr std::size_t kSplineColumns = 16;  // right sides solved at a time: 8 bytes per vertex each

// The local mean that a dowel prescribes: sum of weight * value, with weights of sum 1.
struct LocalMean {
  std::vector<std::pair<int, double>> weights;
  int piece = 0;
};

LocalMean LocalMeanAt(const Vec3& base, double radius_mm, const TriMesh& skull,
                      const MeshQuery& query, const MeshLaplacian& laplacian,
                      const std::vector<int>& pieces) {
  const MeshPoint closest = query.Closest(base);
  const Triangle& t = skull.triangles[closest.triangle];
  LocalMean mean;
  mean.piece = pieces[t[0]];
  double sum = 0;
  for (std::size_t i = 0; radius_mm > 0 && i < skull.points.size(); ++i) {
    const bool near = (skull.points[i] - closest.position).norm() <= radius_mm;
    if (near && pieces[i] == mean.piece) {
      mean.weights.emplace_back(static_cast<int>(i), laplacian.area_mm2[i]);
      sum += laplacian.area_mm2[i];
    }
  }
  for (auto& weight : mean.weights) {
    weight.second /= sum;
  }
  if (mean.weights.empty()) {
    for (int corner = 0; corner < 3; ++corner) {
      mean.weights.emplace_back(t[corner], closest.weights[corner]);
    }
  }
  return mean;
}

// Let b_i be the local means as vectors of weights, and G the inverse of the energy's matrix on
// functions with mean 0 on each piece of the skull. The function of least energy is u = sum_i l_i G
// b_i + one constant per piece, where the l_i of a piece sum to 0. This leaves small equations in
// S_ij = b_i' G b_j, independent of the skull's size. Since the l_i of a piece sum to 0, the row
// and column means of S per piece may be subtracted.
class Spline {
 public:
  Spline(const MeshSpline& options, const TriMesh& skull, const std::vector<DepthSample>& samples,
         const RunContext& run)
      : options_(options),
        laplacian_(BuildLaplacian(skull)),
        pieces_(LabelPieces(laplacian_.stiffness)),
        solver_(skull.points, Grounded()) {
    run.ThrowIfStopped();
    piece_area_.resize(1 + *std::ranges::max_element(pieces_), 0);
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      piece_area_[pieces_[i]] += laplacian_.area_mm2[i];
    }
    const MeshQuery query(skull);
    for (const DepthSample& sample : samples) {
      means_.push_back(
          LocalMeanAt(sample.base, options.radius_mm, skull, query, laplacian_, pieces_));
    }
  }

  std::vector<double> Solve(const std::vector<DepthSample>& samples, const RunContext& run) const {
    std::vector<Eigen::Index> all(means_.size());
    std::iota(all.begin(), all.end(), 0);
    const Pulls pulls = SolvePulls(Kernel(run), samples, all);
    const Eigen::VectorXd varying = Varying(Combined(pulls.pull));
    const Eigen::VectorXd constants =
        MeanByPiece(pulls.met - EvaluateMeans(varying), PiecesAt(all));
    std::vector<double> values(pieces_.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = constants[pieces_[i]] + varying[static_cast<Eigen::Index>(i)];
    }
    return values;
  }

  // The local means at the samples of `fold`, of the function without these samples. kernel: S of
  // all samples.
  std::vector<double> ValuesWithout(const std::vector<std::size_t>& fold,
                                    const std::vector<DepthSample>& samples,
                                    const Eigen::MatrixXd& kernel) const {
    std::vector<Eigen::Index> shown;
    for (std::size_t k = 0; k < means_.size(); ++k) {
      if (std::ranges::find(fold, k) == fold.end()) {
        shown.push_back(static_cast<Eigen::Index>(k));
      }
    }
    const Eigen::MatrixXd between = kernel(shown, shown);
    const Pulls pulls = SolvePulls(between, samples, shown);
    const Eigen::VectorXd constants =
        MeanByPiece(pulls.met - between * pulls.pull, PiecesAt(shown));
    std::vector<double> values;
    for (const std::size_t i : fold) {
      const Eigen::RowVectorXd to_shown = kernel(static_cast<Eigen::Index>(i), shown);
      values.push_back(constants[means_[i].piece] + to_shown.dot(pulls.pull));
    }
    return values;
  }

  // S before centring.
  Eigen::MatrixXd Kernel(const RunContext& run) const {
    const Eigen::Index n = Size();
    const bool inner_product = options_.energy == SplineEnergy::kLaplacian && n <= kMaxHeld;
    Eigen::MatrixXd held(inner_product ? laplacian_.area_mm2.size() : 0, n), kernel(n, n);
    const std::size_t blocks = (means_.size() + kSplineColumns - 1) / kSplineColumns;
    ParallelFor(blocks, run.threads, 1, [&](std::size_t block) {
      run.ThrowIfStopped();
      const auto first = static_cast<Eigen::Index>(block * kSplineColumns);
      const Eigen::Index count = std::min<Eigen::Index>(kSplineColumns, n - first);
      const Eigen::MatrixXd right =
          Combined(Eigen::MatrixXd::Identity(n, n).middleCols(first, count));
      if (inner_product) {
        held.middleCols(first, count) = HalfVarying(right);
      } else {
        kernel.middleCols(first, count) = EvaluateMeans(Varying(right));
      }
    });
    return inner_product ? Products(held) : kernel;
  }

 private:
  // The solution for the shown local means: pull holds the l_i, and met the means of the function.
  struct Pulls {
    Eigen::VectorXd pull, met;
  };

  // between: S of the shown samples.
  Pulls SolvePulls(const Eigen::MatrixXd& between, const std::vector<DepthSample>& samples,
                   const std::vector<Eigen::Index>& shown) const {
    const Eigen::Index n = std::ssize(shown);
    const std::vector<int> pieces = PiecesAt(shown);
    const Eigen::MatrixXd kernel = Centred(between, pieces);
    const std::vector<int> used = Distinct(pieces);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + std::ssize(used), n + std::ssize(used));
    Eigen::VectorXd right = Eigen::VectorXd::Zero(matrix.rows());
    matrix.topLeftCorner(n, n) = kernel;
    const double spread = kernel.diagonal().mean(), scale = spread > 0 ? spread : 1;
    const double softness = std::max(options_.softness, kMinSoftness) * scale;
    for (Eigen::Index i = 0; i < n; ++i) {
      matrix(i, i) += softness;
      const auto at = std::ranges::find(used, pieces[i]) - used.begin();
      matrix(i, n + at) = matrix(n + at, i) = scale;
      right[i] = samples[shown[i]].depth_mm;
    }
    const Eigen::VectorXd pull = Eigen::PartialPivLU<Eigen::MatrixXd>(matrix).solve(right).head(n);
    return {pull, right.head(n) - softness * pull};
  }

  std::vector<int> PiecesAt(const std::vector<Eigen::Index>& shown) const {
    std::vector<int> pieces;
    for (const Eigen::Index k : shown) {
      pieces.push_back(means_[k].piece);
    }
    return pieces;
  }

  static std::vector<int> Distinct(std::vector<int> pieces) {
    std::ranges::sort(pieces);
    pieces.erase(std::unique(pieces.begin(), pieces.end()), pieces.end());
    return pieces;
  }

  Eigen::Index Size() const { return static_cast<Eigen::Index>(means_.size()); }

  // The stiffness with one vertex per piece fixed, which changes a solution only by a constant.
  Eigen::SparseMatrix<double> Grounded() const {
    Eigen::SparseMatrix<double> matrix = laplacian_.stiffness;
    std::vector<Eigen::Triplet<double>> held;
    for (std::size_t i = 0, next = 0; i < pieces_.size(); ++i) {
      if (pieces_[i] == static_cast<int>(next)) {
        held.emplace_back(static_cast<int>(i), static_cast<int>(i), 1);
        ++next;
      }
    }
    Eigen::SparseMatrix<double> ground(matrix.rows(), matrix.cols());
    ground.setFromTriplets(held.begin(), held.end());
    return matrix + ground;
  }

  // Subtracts from each column, per piece, share / area times the column's sum weighted by
  // `summed`.
  void TakeShares(Eigen::MatrixXd& columns, const Eigen::VectorXd& summed,
                  const Eigen::VectorXd& share) const {
    Eigen::MatrixXd sums =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(piece_area_.size()), columns.cols());
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      sums.row(pieces_[i]) += summed[row] * columns.row(row);
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      columns.row(row) -= share[row] / piece_area_[pieces_[i]] * sums.row(pieces_[i]);
    }
  }

  // Combines the local means' weight vectors: one column per column of `of_mean`.
  Eigen::MatrixXd Combined(const Eigen::MatrixXd& of_mean) const {
    Eigen::MatrixXd right =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(pieces_.size()), of_mean.cols());
    for (std::size_t k = 0; k < means_.size(); ++k) {
      for (const auto& [vertex, weight] : means_[k].weights) {
        right.row(vertex) += weight * of_mean.row(static_cast<Eigen::Index>(k));
      }
    }
    return right;
  }

  // G times right sides, with mean 0 on each piece. If a right side's sum on a piece is not 0, the
  // fixed vertex adds the same to all local means of the piece, which cancels because the l_i sum
  // to 0.
  Eigen::MatrixXd Varying(const Eigen::MatrixXd& right) const {
    const Eigen::MatrixXd values = HalfVarying(right);
    return options_.energy == SplineEnergy::kLaplacian
               ? HalfVarying(laplacian_.area_mm2.asDiagonal() * values)
               : values;
  }

  // The same with the inverse of the stiffness for G.
  Eigen::MatrixXd HalfVarying(const Eigen::MatrixXd& right) const {
    const Eigen::VectorXd& area = laplacian_.area_mm2;
    Eigen::MatrixXd values = solver_.Solve(right);
    TakeShares(values, area, Eigen::VectorXd::Ones(area.size()));
    return values;
  }

  // The local means of functions, given as columns.
  Eigen::MatrixXd EvaluateMeans(const Eigen::MatrixXd& values) const {
    Eigen::MatrixXd at = Eigen::MatrixXd::Zero(Size(), values.cols());
    for (Eigen::Index k = 0; k < Size(); ++k) {
      for (const auto& [vertex, weight] : means_[k].weights) {
        at.row(k) += weight * values.row(vertex);
      }
    }
    return at;
  }

  // The mean per piece of one value per local mean; NaN on pieces without local means. piece: the
  // piece of each local mean.
  Eigen::VectorXd MeanByPiece(const Eigen::VectorXd& of_mean, const std::vector<int>& piece) const {
    const auto count = static_cast<Eigen::Index>(piece_area_.size());
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(count), members = sum;
    for (Eigen::Index k = 0; k < of_mean.size(); ++k) {
      sum[piece[k]] += of_mean[k];
      ++members[piece[k]];
    }
    return sum.cwiseQuotient(members);
  }

  // Subtracts the means per piece of the columns and then of the rows.
  Eigen::MatrixXd Centred(Eigen::MatrixXd matrix, const std::vector<int>& piece) const {
    for (int side = 0; side < 2; ++side) {
      for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
        const Eigen::VectorXd mean = MeanByPiece(matrix.col(c), piece);
        for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
          matrix(r, c) -= mean[piece[r]];
        }
      }
      matrix.transposeInPlace();
    }
    return matrix;
  }

  // With the Laplacian energy, S is an inner product of half-way functions, which saves half of the
  // solves.
  Eigen::MatrixXd Products(const Eigen::MatrixXd& half_way) const {
    return half_way.transpose() * laplacian_.area_mm2.asDiagonal() * half_way;
  }

  MeshSpline options_;
  MeshLaplacian laplacian_;
  std::vector<int> pieces_;
  MeshSolver solver_;
  std::vector<double> piece_area_;
  std::vector<LocalMean> means_;
};

}  // namespace

std::vector<double> SolveMeshSpline(const MeshSpline& spline, std::string_view scheme,
                                    const TriMesh& skull, const std::vector<DepthSample>& samples,
                                    const RunContext& run) {
  run.ThrowIfStopped();
  CheckSurface(scheme, skull);
  return Spline(spline, skull, samples, run).Solve(samples, run);
}

std::vector<DepthField> MeshSplineLeftOut(const MeshSpline& spline, std::string_view scheme,
                                          bool clamp, double max_angle_deg, const DepthInput& input,
                                          const Folds& folds, const RunContext& run) {
  CheckDepthInput(input);
  CheckSurface(scheme, input.skull);
  std::vector<DepthSample> samples;
  for (const Dowel& dowel : input.dowels) {
    samples.push_back({dowel.base, dowel.direction, dowel.depth_mm, dowel.sd_mm});
  }
  const Spline function(spline, input.skull, samples, run);
  const Eigen::MatrixXd kernel = function.Kernel(run);
  std::vector<DepthField> fields;
  for (const std::vector<std::size_t>& fold : folds) {
    run.ThrowIfStopped();
    const ShownDowels shown = LeaveOutDowels(input.dowels, input.network, fold);
    const std::vector<DepthSample> shown_samples = DepthSamples(shown.dowels);
    TriMesh bases;
    std::vector<Vec3> directions;
    for (const std::size_t i : fold) {
      bases.points.push_back(input.dowels[i].base);
      directions.push_back(input.dowels[i].direction);
    }
    fields.push_back(AssignSpline(
        function.ValuesWithout(fold, samples, kernel), DepthLimits(shown_samples, clamp),
        {bases, directions, shown.dowels, shown.network}, shown_samples, max_angle_deg, run));
  }
  return fields;
}

DepthField AssignSpline(const std::vector<double>& depth_mm, const DepthLimits& limits,
                        const DepthInput& input, const std::vector<DepthSample>& samples,
                        double max_angle_deg, const RunContext& run) {
  return AssignWhereFacing(input, samples, max_angle_deg, run, [&](std::size_t i) {
    return DepthValue{limits(depth_mm[i]), kNaN};
  });
}

}  // namespace semblance::interp
