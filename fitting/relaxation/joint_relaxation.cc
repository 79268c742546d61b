// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/joint_relaxation.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/relaxation/relaxer.h"
#include "fitting/solve/auto_weight.h"
#include "fitting/terms/term_cost.h"
#include "surfaces/base/error.h"
#include "surfaces/hspline/bspline.h"

namespace semblance::fitting {
namespace {

constexpr int kSteps = 5;        // of Levenberg-Marquardt; the next round starts from a new patch
constexpr double kBeyond = 0.1;  // reach beyond a patch's edge; its polynomial extrapolates there
constexpr int kHalvings = 8;     // of a single move, for the barrier; then it is dropped
constexpr int kAllHalvings = 4;  // of all moves; each costs a fit
using Mat2 = Eigen::Matrix2d;

struct PatchIndex {
  int i = 0, j = 0;
};

PatchIndex PatchAt(const PatchGrid& grid, const Vec2& uv) {
  return {std::clamp(static_cast<int>(uv.x() * grid.patches_u), 0, grid.patches_u - 1),
          std::clamp(static_cast<int>(uv.y() * grid.patches_v), 0, grid.patches_v - 1)};
}

// Residual factor (S(u,v) - p). S is the patch's polynomial plus the detail of finer levels.
// Parameter blocks: (u,v) in mm, then the patch's sixteen vertices.
class JointPointCost final : public ceres::CostFunction {
 public:
  JointPointCost(const JointLevel& level, const PatchIndex& patch, const Vec3& position,
                 double factor)
      : level_(level), patch_(patch), position_(position), factor_(factor) {
    mutable_parameter_block_sizes()->assign(17, 3);
    mutable_parameter_block_sizes()->front() = 2;
    set_num_residuals(3);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Vec2 uv = Eigen::Map<const Vec2>(parameters[0]).cwiseQuotient(level_.view.lengths_mm);
    const PatchGrid& grid = level_.view.grid;
    const double s = uv.x() * grid.patches_u - patch_.i, t = uv.y() * grid.patches_v - patch_.j;
    const auto a = CubicWeights(s, 0), b = CubicWeights(t, 0);
    const auto da = CubicWeights(s, 1), db = CubicWeights(t, 1);
    Vec3 r = -position_, ru = Vec3::Zero(), rv = Vec3::Zero();
    for (int k = 0; k < 16; ++k) {
      const Vec3 c = Eigen::Map<const Vec3>(parameters[1 + k]);
      r += a[k % 4] * b[k / 4] * c;
      ru += grid.patches_u * da[k % 4] * b[k / 4] * c;
      rv += grid.patches_v * a[k % 4] * db[k / 4] * c;
    }
    AddDetail(uv, r, ru, rv);
    Eigen::Map<Vec3>(residuals, 3) = factor_ * r;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 2, Eigen::RowMajor>> j(jacobians[0]);
      j << factor_ / level_.view.lengths_mm.x() * ru, factor_ / level_.view.lengths_mm.y() * rv;
    }
    for (int k = 0; jacobians != nullptr && k < 16; ++k) {
      if (jacobians[1 + k] != nullptr) {
        Eigen::Map<Mat3>(jacobians[1 + k], 3, 3) = factor_ * a[k % 4] * b[k / 4] * Mat3::Identity();
      }
    }
    return true;
  }

 private:
  void AddDetail(const Vec2& uv, Vec3& r, Vec3& ru, Vec3& rv) const {
    if (level_.detail == nullptr) {
      return;
    }
    const SurfaceFrame all = level_.detail->Frame(uv),
                       coarse = level_.detail->LevelFrame(level_.level, uv);
    r += all.point - coarse.point;
    ru += all.du - coarse.du;
    rv += all.dv - coarse.dv;
  }

  const JointLevel& level_;
  PatchIndex patch_;
  Vec3 position_;
  double factor_;
};

// The quadratic model of a corner's penalties about a place: 2 g . m + m . M m up to a constant,
// where m is the move from the place; g, m and M in mm.
class PenaltyCost final : public ceres::SizedCostFunction<2, 2> {
 public:
  PenaltyCost(const Vec2& place, const Vec2& gradient, const Mat2& matrix)
      : place_(place),
        root_(matrix.llt().matrixU()),
        right_(-matrix.llt().matrixL().solve(gradient)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Vec2 way = Eigen::Map<const Vec2>(parameters[0]) - place_;
    Eigen::Map<Vec2>(residuals, 2) = root_ * way - right_;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 2, Eigen::RowMajor>>(jacobians[0], 2, 2) = root_;
    }
    return true;
  }

 private:
  Vec2 place_;
  Mat2 root_;
  Vec2 right_;
};

class JointRound {
 public:
  JointRound(const HSplineSurface& surface, const HSplineSurface& rest, const DowelMesh& mesh,
             const NetworkMoves& moves, const JointLevel& level, const FitTarget& target)
      : mesh_(mesh),
        moves_(moves),
        level_(level),
        target_(target),
        relaxer_(surface, rest, mesh, moves, target),
        order_(relaxer_.Order()),
        start_(relaxer_.uv()),
        penalty_weight_(PointWeight(level.terms) / static_cast<double>(target.points.size())),
        weight_sum_(relaxer_.mean_weight() * static_cast<double>(target.points.size())) {}

  // Returns the new (u,v) of the points.
  std::vector<Vec2> Run(RelaxationSummary& summary) {
    summary.before = relaxer_.Penalties();
    const std::vector<Vec2> way = Shortened(SolveMoves(), summary);
    const double before = Energy(start_);
    double share = 1;
    for (int k = 0; k < kAllHalvings; ++k, share /= 2) {
      const std::vector<Vec2> uv = At(way, share);
      if ((!moves_.barrier || mesh_.Flips(uv) == 0) && Energy(uv) < before) {
        summary.after = relaxer_.Penalties();
        return uv;
      }
    }
    relaxer_.SetUv(start_);
    summary.after = relaxer_.Penalties();
    return start_;
  }

 private:
  // The move of each corner in (u,v) that minimises the joint problem; zero for other points.
  std::vector<Vec2> SolveMoves();
  void AddPoints(ControlNet& net, std::vector<Vec2>& places, ceres::Problem& problem) const;
  void AddPoint(const FitPoint& point, std::size_t k, double scale,
                std::unique_ptr<ceres::LossFunction> loss, ControlNet& net,
                std::vector<Vec2>& places, ceres::Problem& problem) const;
  void AddPenalties(std::vector<Vec2>& places, ceres::Problem& problem) const;
  void Bound(std::vector<Vec2>& places, ceres::Problem& problem) const;

  // Halves the moves of the corners of triangles that would turn over, and at last drops them.
  std::vector<Vec2> Shortened(std::vector<Vec2> way, RelaxationSummary& summary) const {
    std::vector<char> cut(way.size());
    bool moving = moves_.barrier;
    for (int pass = 0; moving; ++pass) {
      const std::vector<Vec2> uv = At(way, 1);
      int turned = 0;
      std::vector<char> corners(way.size());
      for (const auto& t : mesh_.triangles()) {
        if (mesh_.Turned(t, uv)) {
          ++turned;
          corners[t[0]] = corners[t[1]] = corners[t[2]] = 1;
        }
      }
      moving = false;
      summary.flips_prevented += pass == 0 ? turned : 0;
      for (std::size_t k = 0; k < way.size(); ++k) {
        if (corners[k] != 0 && !way[k].isZero(0)) {
          moving = true;
          way[k] *= pass < kHalvings ? 0.5 : 0.0;
          cut[k] = 1;
        }
      }
    }
    summary.steps_shortened += static_cast<int>(std::count(cut.begin(), cut.end(), 1));
    return way;
  }

  // The (u,v) of all points after the given share of their corners' moves.
  std::vector<Vec2> At(const std::vector<Vec2>& way, double share) const {
    std::vector<Vec2> uv = start_;
    for (std::size_t k = 0; k < uv.size(); ++k) {
      uv[k] = (uv[k] + share * way[mesh_.corner()[k]]).cwiseMax(0).cwiseMin(1);
    }
    return uv;
  }

  double Energy(const std::vector<Vec2>& uv) {
    FitTarget target = target_;
    for (std::size_t k = 0; k < uv.size(); ++k) {
      target.points[k].uv = uv[k];
    }
    relaxer_.SetUv(uv);
    double sum = 0;
    for (const int corner : order_) {
      sum += relaxer_.WithoutDistance(corner).energy;
    }
    return level_.cost(target) + penalty_weight_ * sum;
  }

  const DowelMesh& mesh_;
  const NetworkMoves& moves_;
  const JointLevel& level_;
  const FitTarget& target_;
  Relaxer relaxer_;
  std::vector<int> order_;  // the corners, sorted by the template's (u,v)
  std::vector<Vec2> start_;
  double penalty_weight_;
  double weight_sum_;
};

void JointRound::AddPoints(ControlNet& net, std::vector<Vec2>& places,
                           ceres::Problem& problem) const {
  const double landmark_sum = level_.view.LandmarkWeightSum();
  for (const Term& term : level_.terms) {
    const auto* const points = std::get_if<PointTerm>(&term);
    const auto* const landmarks = std::get_if<LandmarkTerm>(&term);
    if (TermWeight(term) <= 0 || (points == nullptr && landmarks == nullptr)) {
      continue;
    }
    for (std::size_t k = 0; k < places.size(); ++k) {
      for (const int m : relaxer_.members(order_[k])) {
        const FitPoint& p = target_.points[m];
        if (points != nullptr) {
          const double scale = points->weight * p.weight / weight_sum_;
          AddPoint(p, k, scale,
                   points->loss == RobustLoss::kNone ? nullptr : MakeLoss(*points, scale), net,
                   places, problem);
        } else if (p.role == PointRole::kLandmark) {
          AddPoint(p, k, landmarks->weight * p.weight / landmark_sum, nullptr, net, places,
                   problem);
        }
      }
    }
  }
}

// Adds the residual of a point at the k-th place. scale: factor of its squared distance; a loss
// already includes it.
void JointRound::AddPoint(const FitPoint& point, std::size_t k, double scale,
                          std::unique_ptr<ceres::LossFunction> loss, ControlNet& net,
                          std::vector<Vec2>& places, ceres::Problem& problem) const {
  const PatchIndex patch = PatchAt(level_.view.grid, start_[order_[k]]);
  std::vector<double*> blocks = {places[k].data()};
  for (const int vertex : level_.view.grid.PatchVertices(patch.i, patch.j)) {
    blocks.push_back(net.vertices[vertex].data());
  }
  problem.AddResidualBlock(
      new JointPointCost(level_, patch, point.position, loss ? 1 : std::sqrt(scale)),
      loss.release(), blocks);
}

void JointRound::AddPenalties(std::vector<Vec2>& places, ceres::Problem& problem) const {
  const Mat2 per_mm = level_.view.lengths_mm.cwiseInverse().asDiagonal();
  for (std::size_t k = 0; k < places.size(); ++k) {
    const int corner = order_[k];
    const LocalPenalty held = relaxer_.WithoutDistance(corner);
    const Mat2 matrix = per_mm * (held.matrix + relaxer_.Damping(corner)) * per_mm;
    problem.AddResidualBlock(new PenaltyCost(places[k], penalty_weight_ * (per_mm * held.gradient),
                                             penalty_weight_ * (matrix + 1e-12 * Mat2::Identity())),
                             nullptr, places[k].data());
  }
}

// Bounds each place to its patch and slightly beyond, to the domain, and to max_move_mm.
void JointRound::Bound(std::vector<Vec2>& places, ceres::Problem& problem) const {
  const Vec2 patches(level_.view.grid.patches_u, level_.view.grid.patches_v);
  for (std::size_t k = 0; k < places.size(); ++k) {
    const int corner = order_[k];
    const PatchIndex patch = PatchAt(level_.view.grid, start_[corner]);
    const Vec2 low(patch.i, patch.j), far = relaxer_.LongestMove(corner);
    for (int axis = 0; axis < 2; ++axis) {
      const double at = start_[corner][axis];
      const double lower = std::max({(low[axis] - kBeyond) / patches[axis], at - far[axis], 0.0});
      const double upper =
          std::min({(low[axis] + 1 + kBeyond) / patches[axis], at + far[axis], 1.0});
      const double length = level_.view.lengths_mm[axis];
      problem.SetParameterLowerBound(places[k].data(), axis,
                                     std::min(lower * length, places[k][axis]));
      problem.SetParameterUpperBound(places[k].data(), axis,
                                     std::max(upper * length, places[k][axis]));
    }
  }
}

ceres::Solver::Options SchurOptions(std::vector<Vec2>& places, ControlNet& net,
                                    const ceres::Problem& problem) {
  UseOneLibraryThread();
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.max_num_iterations = kSteps;
  options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (Vec2& place : places) {
    options.linear_solver_ordering->AddElementToGroup(place.data(), 0);
  }
  for (Vec3& vertex : net.vertices) {
    if (problem.HasParameterBlock(vertex.data())) {
      options.linear_solver_ordering->AddElementToGroup(vertex.data(), 1);
    }
  }
  return options;
}

std::vector<Vec2> JointRound::SolveMoves() {
  ControlNet net = level_.view.start;
  std::vector<Vec2> places;
  for (const int corner : order_) {
    places.push_back(start_[corner].cwiseProduct(level_.view.lengths_mm));
  }
  ceres::Problem problem;
  AddPoints(net, places, problem);
  AddPenalties(places, problem);
  for (const Term& term : level_.terms) {
    std::visit(
        [&]<class T>(const T& t) {
          if (!std::is_same_v<T, PointTerm> && !std::is_same_v<T, LandmarkTerm> && t.weight > 0) {
            AddResiduals(t, level_.view, net, problem);
          }
        },
        term);
  }
  Bound(places, problem);
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (relaxer_.IsKept(order_[k])) {
      problem.SetParameterBlockConstant(places[k].data());
    }
  }
  ceres::Solver::Summary summary;
  ceres::Solve(SchurOptions(places, net, problem), &problem, &summary);
  std::vector<Vec2> way(start_.size(), Vec2::Zero());
  for (std::size_t k = 0; summary.IsSolutionUsable() && k < places.size(); ++k) {
    const int corner = order_[k];
    if (!relaxer_.IsKept(corner)) {
      way[corner] = places[k].cwiseQuotient(level_.view.lengths_mm) - start_[corner];
    }
  }
  return way;
}

}  // namespace

RelaxationSummary RelaxJointly(const HSplineSurface& surface, const HSplineSurface& rest,
                               const DowelMesh& mesh, const NetworkMoves& moves,
                               const JointLevel& level, FitTarget& target) {
  if (PointWeight(level.terms) <= 0) {
    throw InputError(
        "relaxation: joint moves points that the fit draws to the surface; add a term "
        "'points' with a weight");
  }
  JointRound round(surface, rest, mesh, moves, level, target);
  RelaxationSummary summary;
  MovePoints(surface, round.Run(summary), target, summary);
  return summary;
}

}  // namespace semblance::fitting
