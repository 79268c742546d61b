// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/mesh_spline.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "interp/mesh_laplacian.h"
#include "surfaces/mesh_query.h"
#include "surfaces/parallel.h"
#include "surfaces/point_triangle.h"

namespace semblance {
namespace {

constexpr double kLeastSoftness = 1e-12;  // two dowels closest to one vertex must not be singular

// The function's mean that one dowel speaks of: sum of weight times value, weights of sum 1.
struct Place {
  std::vector<std::pair<int, double>> weights;
  int piece = 0;
};

Place PlaceOf(const Vec3& base, double radius_mm, const TriMesh& skull, const MeshQuery& query,
              const MeshLaplacian& laplacian, const std::vector<int>& pieces) {
  const MeshPoint closest = query.Closest(base);
  const Triangle& t = skull.triangles[closest.triangle];
  Place place;
  place.piece = pieces[t[0]];
  double sum = 0;
  for (std::size_t i = 0; radius_mm > 0 && i < skull.points.size(); ++i) {
    const bool near = (skull.points[i] - closest.position).norm() <= radius_mm;
    if (near && pieces[i] == place.piece) {
      place.weights.emplace_back(static_cast<int>(i), laplacian.area_mm2[i]);
      sum += laplacian.area_mm2[i];
    }
  }
  for (auto& weight : place.weights) {
    weight.second /= sum;
  }
  if (place.weights.empty()) {
    const Vec3 corners = ClosestPointOnTriangle(closest.position, skull.points[t[0]],
                                                skull.points[t[1]], skull.points[t[2]])
                             .weights;
    place.weights = {{t[0], corners[0]}, {t[1], corners[1]}, {t[2], corners[2]}};
  }
  return place;
}

// Let b_i be the places, G the inverse of the energy's matrix on functions of mean 0, piece by
// piece. The least energy with means d + residuals is u = sum_i l_i G b_i + a constant a piece,
// where the l_i of a piece sum to 0: small equations in S_ij = b_i' G b_j, whatever the skull's
// size.
class Spline {
 public:
  Spline(const MeshSpline& options, const TriMesh& skull, const std::vector<DepthSample>& samples,
         const RunContext& run)
      : options_(options),
        laplacian_(BuildLaplacian(skull)),
        pieces_(Pieces(laplacian_.stiffness)),
        solver_(skull.points, Grounded()) {
    run.ThrowIfStopped();
    piece_area_.resize(1 + *std::ranges::max_element(pieces_), 0);
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      piece_area_[pieces_[i]] += laplacian_.area_mm2[i];
    }
    const MeshQuery query(skull);
    for (const DepthSample& sample : samples) {
      places_.push_back(PlaceOf(sample.base, options.radius_mm, skull, query, laplacian_, pieces_));
    }
  }

  std::vector<double> Solve(const std::vector<DepthSample>& samples, const RunContext& run) const {
    const Eigen::Index n = Size();
    const Eigen::MatrixXd kernel = Kernel(run);
    const auto count = static_cast<Eigen::Index>(piece_area_.size());
    const std::vector<int> used = UsedPieces();
    const auto tail = static_cast<Eigen::Index>(used.size());
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + tail, n + tail);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n + tail);
    matrix.topLeftCorner(n, n) = kernel;
    const double scale = std::max(kernel.diagonal().mean(), 1e-300);
    for (Eigen::Index i = 0; i < n; ++i) {
      matrix(i, i) += std::max(options_.softness, kLeastSoftness) * scale;
      const auto at = std::ranges::find(used, places_[i].piece) - used.begin();
      matrix(i, n + at) = matrix(n + at, i) = scale;
      right[i] = samples[i].depth_mm;
    }
    const Eigen::VectorXd solution = Eigen::PartialPivLU<Eigen::MatrixXd>(matrix).solve(right);
    Eigen::VectorXd constants = Eigen::VectorXd::Constant(count, kNaN);
    for (Eigen::Index k = 0; k < tail; ++k) {
      constants[used[k]] = scale * solution[n + k];
    }
    const Eigen::VectorXd varying = Varying(Combined(solution.head(n)));
    std::vector<double> values(pieces_.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = constants[pieces_[i]] + varying[static_cast<Eigen::Index>(i)];
    }
    return values;
  }

 private:
  Eigen::Index Size() const { return static_cast<Eigen::Index>(places_.size()); }

  // The stiffness with one vertex a piece held, which changes no solution but for a constant.
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

  void TakeMeans(Eigen::VectorXd& values) const {
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(piece_area_.size()));
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      sums[pieces_[i]] += laplacian_.area_mm2[i] * values[i];
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      values[i] -= sums[pieces_[i]] / piece_area_[pieces_[i]];
    }
  }

  Eigen::VectorXd Combined(const Eigen::VectorXd& of_place) const {
    Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(pieces_.size()));
    for (std::size_t k = 0; k < places_.size(); ++k) {
      for (const auto& [vertex, weight] : places_[k].weights) {
        right[vertex] += of_place[static_cast<Eigen::Index>(k)] * weight;
      }
    }
    return right;
  }

  // G times a right side; of mean 0 on each piece.
  Eigen::VectorXd Varying(Eigen::VectorXd right) const {
    Eigen::VectorXd totals = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(piece_area_.size()));
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      totals[pieces_[i]] += right[i];
    }
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      right[i] -= totals[pieces_[i]] / piece_area_[pieces_[i]] * laplacian_.area_mm2[i];
    }
    Eigen::VectorXd values = solver_.Solve(right);
    TakeMeans(values);
    if (options_.energy == SplineEnergy::kLaplacian) {
      values = solver_.Solve(laplacian_.area_mm2.cwiseProduct(values));
      TakeMeans(values);
    }
    return values;
  }

  Eigen::MatrixXd Kernel(const RunContext& run) const {
    Eigen::MatrixXd kernel(Size(), Size());
    ParallelFor(places_.size(), run.threads, 1, [&](std::size_t column) {
      run.ThrowIfStopped();
      const auto c = static_cast<Eigen::Index>(column);
      const Eigen::VectorXd values = Varying(Combined(Eigen::VectorXd::Unit(Size(), c)));
      for (Eigen::Index r = 0; r < Size(); ++r) {
        kernel(r, c) = 0;
        for (const auto& [vertex, weight] : places_[r].weights) {
          kernel(r, c) += weight * values[vertex];
        }
      }
    });
    return kernel;
  }

  std::vector<int> UsedPieces() const {
    std::vector<int> used;
    for (const Place& place : places_) {
      used.push_back(place.piece);
    }
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    return used;
  }

  MeshSpline options_;
  MeshLaplacian laplacian_;
  std::vector<int> pieces_;
  MeshSolver solver_;
  std::vector<double> piece_area_;
  std::vector<Place> places_;
};

}  // namespace

std::vector<double> SolveMeshSpline(const MeshSpline& spline, std::string_view scheme,
                                    const TriMesh& skull, const std::vector<DepthSample>& samples,
                                    const RunContext& run) {
  run.ThrowIfStopped();
  CheckSurface(scheme, skull);
  return Spline(spline, skull, samples, run).Solve(samples, run);
}

DepthField AssignSpline(const std::vector<double>& depth_mm, const DepthLimits& limits,
                        const DepthInput& input, const std::vector<DepthSample>& samples,
                        double max_angle_deg, const RunContext& run) {
  return AssignWhereFacing(input, samples, max_angle_deg, run, [&](std::size_t i) {
    return DepthValue{limits(depth_mm[i]), kNaN};
  });
}

}  // namespace semblance
