// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/springs/spring_net.h"

#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "fitting/least_squares/sparse_factor.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/correspondences.h"

namespace semblance::fitting {
namespace {

constexpr double kBoneWeight = 100;     // bone is hard
constexpr double kStillMove_mm = 0.01;  // a round that moves no vertex farther is the last one

struct Spring {
  int a = -1, b = -1;
  double rest_mm = kNaN;
  double stiffness = kNaN;
};

// Residual sqrt(stiffness) (|a - b| - rest).
class NetSpringCost final : public ceres::SizedCostFunction<1, 3, 3> {
 public:
  explicit NetSpringCost(const Spring& spring)
      : root_(std::sqrt(spring.stiffness)), rest_mm_(spring.rest_mm) {}

  bool Evaluate(const double* const* vertices, double* residuals,
                double** jacobians) const override {
    const Vec3 apart = Eigen::Map<const Vec3>(vertices[0]) - Eigen::Map<const Vec3>(vertices[1]);
    const double length_mm = apart.norm();
    residuals[0] = root_ * (length_mm - rest_mm_);
    const Vec3 slope = length_mm > 0 ? Vec3(root_ * apart / length_mm) : Vec3(Vec3::Zero());
    for (int k = 0; jacobians != nullptr && k < 2; ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Vec3>{jacobians[k]} = k == 0 ? slope : Vec3(-slope);
      }
    }
    return true;
  }

 private:
  double root_, rest_mm_;
};

// Residual n . (x - c).
class NetDepthCost final : public ceres::SizedCostFunction<1, 3> {
 public:
  explicit NetDepthCost(const Correspondence& foot) : foot_(foot) {}

  bool Evaluate(const double* const* vertices, double* residuals,
                double** jacobians) const override {
    residuals[0] = foot_.normal.dot(Eigen::Map<const Vec3>(vertices[0]) - foot_.point.position);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Vec3>{jacobians[0]} = foot_.normal;
    }
    return true;
  }

 private:
  Correspondence foot_;
};

// Residual 10 max(0, clearance - m . (x - f)).
class NetBoneCost final : public ceres::SizedCostFunction<1, 3> {
 public:
  NetBoneCost(const Correspondence& foot, double clearance_mm)
      : foot_(foot), clearance_mm_(clearance_mm) {}

  bool Evaluate(const double* const* vertices, double* residuals,
                double** jacobians) const override {
    const double outside_mm =
        foot_.normal.dot(Eigen::Map<const Vec3>(vertices[0]) - foot_.point.position);
    const double root = std::sqrt(kBoneWeight);
    residuals[0] = root * std::max(0.0, clearance_mm_ - outside_mm);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Vec3>{jacobians[0]} =
          outside_mm < clearance_mm_ ? Vec3(-root * foot_.normal) : Vec3(Vec3::Zero());
    }
    return true;
  }

 private:
  Correspondence foot_;
  double clearance_mm_;
};

// ---------------------------------------------------------------------------------------------
// The net
// ---------------------------------------------------------------------------------------------

void CheckNet(const SpringNet& net) {
  const std::size_t count =
      net.columns > 0 && net.rows > 0 ? static_cast<std::size_t>(net.columns) * net.rows : 0;
  if (net.columns < 2 || net.rows < 2 || net.vertices.size() != count ||
      net.at_rest.size() != count || net.holds.size() != count) {
    throw InputError(fmt::format(
        "spring net: {} x {} vertices, with {} positions, {} at rest and {} holds; it needs two "
        "columns and rows or more, and one of each per vertex",
        net.columns, net.rows, net.vertices.size(), net.at_rest.size(), net.holds.size()));
  }
}

std::vector<Spring> MakeSprings(const SpringNet& net, const SpringOptions& options) {
  std::vector<Spring> springs;
  const auto add = [&](int i, int j, int du, int dv, double stiffness) {
    if (i + du < 0 || i + du >= net.columns || j + dv >= net.rows || stiffness == 0) {
      return;
    }
    const int a = i + j * net.columns, b = a + du + dv * net.columns;
    springs.push_back({a, b, (net.at_rest[a] - net.at_rest[b]).norm(), stiffness});
  };
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      add(i, j, 1, 0, options.stretch);
      add(i, j, 0, 1, options.stretch);
      add(i, j, 1, 1, options.stretch);
      add(i, j, -1, 1, options.stretch);
      add(i, j, 2, 0, options.bend);
      add(i, j, 0, 2, options.bend);
    }
  }
  return springs;
}

// The unit normal du x dv at a vertex, by differences to its neighbours.
Vec3 NetNormal(const SpringNet& net, int vertex) {
  const int i = vertex % net.columns, j = vertex / net.columns;
  const auto at = [&](int column, int row) {
    return net.vertices[std::clamp(column, 0, net.columns - 1) +
                        std::clamp(row, 0, net.rows - 1) * net.columns];
  };
  return (at(i + 1, j) - at(i - 1, j)).cross(at(i, j + 1) - at(i, j - 1)).normalized();
}

// ---------------------------------------------------------------------------------------------
// The relaxation
// ---------------------------------------------------------------------------------------------

// The problem of one round.
class SpringRound {
 public:
  SpringRound(const SpringNet& net, const std::vector<Spring>& springs) : vertices_(net.vertices) {
    for (const Spring& spring : springs) {
      springs_.push_back(problem_.AddResidualBlock(new NetSpringCost(spring), nullptr,
                                                   vertices_[spring.a].data(),
                                                   vertices_[spring.b].data()));
    }
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      if (net.holds[v] == SpringHold::kLocked && problem_.HasParameterBlock(vertices_[v].data())) {
        problem_.SetParameterBlockConstant(vertices_[v].data());
      }
    }
  }

  void Hold(std::size_t vertex, const Correspondence& foot) {
    depth_.push_back(
        problem_.AddResidualBlock(new NetDepthCost(foot), nullptr, vertices_[vertex].data()));
  }
  void KeepOut(std::size_t vertex, const Correspondence& foot, double clearance_mm) {
    bone_.push_back(problem_.AddResidualBlock(new NetBoneCost(foot, clearance_mm), nullptr,
                                              vertices_[vertex].data()));
  }

  // Ceres' cost is half of ours.
  std::vector<double> Costs() {
    std::vector<double> costs;
    for (const auto* const blocks : {&springs_, &depth_, &bone_}) {
      ceres::Problem::EvaluateOptions options;
      options.residual_blocks = *blocks;
      double cost = 0;
      if (!blocks->empty()) {  // without blocks Ceres would take all
        problem_.Evaluate(options, &cost, nullptr, nullptr, nullptr);
      }
      costs.push_back(2 * cost);
    }
    return costs;
  }

  ceres::Solver::Summary Solve() {
    UseOneLibraryThread();
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.num_threads = 1;
    options.max_num_iterations = 50;
    options.function_tolerance = 1e-8;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary;
  }

  int held() const { return static_cast<int>(depth_.size()); }
  const std::vector<Vec3>& vertices() const { return vertices_; }

 private:
  std::vector<Vec3> vertices_;
  ceres::Problem problem_;
  std::vector<ceres::ResidualBlockId> springs_, depth_, bone_;
};

// The feet of vertices on a mesh that may lack triangles.
std::optional<Correspondences> MakeFeet(const TriMesh& mesh, OpenBorder border) {
  return mesh.triangles.empty() ? std::nullopt
                                : std::optional<Correspondences>(std::in_place, mesh, border);
}

class SpringRelaxer {
 public:
  SpringRelaxer(const TriMesh& depth_mesh, const TriMesh& bone, const SpringOptions& options,
                SpringNet& net)
      : options_(options),
        net_(net),
        start_(net.vertices),
        springs_(MakeSprings(net, options)),
        depth_(MakeFeet(depth_mesh, OpenBorder::kReject)),
        bone_(MakeFeet(bone, OpenBorder::kAccept)) {
    summary_.locked = static_cast<int>(std::ranges::count(net.holds, SpringHold::kLocked));
    summary_.rounds = summary_.iterations = 0;
    summary_.usable = true;
  }

  bool GoesOn() const {
    return summary_.usable && summary_.rounds < options_.rounds &&
           (summary_.rounds == 0 || summary_.last_move_mm >= kStillMove_mm);
  }

  void Round() {
    SpringRound round(net_, springs_);
    AddFeet(round);
    const std::vector<double> before = round.Costs();
    const ceres::Solver::Summary solved = round.Solve();
    summary_.termination = ceres::TerminationTypeToString(solved.termination_type);
    summary_.usable = solved.IsSolutionUsable();
    summary_.iterations += static_cast<int>(solved.iterations.size()) - 1;
    summary_.held = round.held();
    ++summary_.rounds;
    if (summary_.usable) {
      summary_.last_move_mm = LargestMove(net_.vertices, round.vertices());
      net_.vertices = round.vertices();
      Measure(before, round.Costs());
    }
  }

  SpringSummary Result() {
    PushOut();
    summary_.max_move_mm = LargestMove(start_, net_.vertices);
    return summary_;
  }

 private:
  void AddFeet(SpringRound& round) const {
    const CorrespondenceOptions match{
        .reach_mm = options_.reach_mm,
        .least_cosine = std::cos(options_.max_angle_deg * std::numbers::pi / 180)};
    for (std::size_t v = 0; v < net_.vertices.size(); ++v) {
      if (net_.holds[v] == SpringHold::kLocked) {
        continue;
      }
      const Vec3& at = net_.vertices[v];
      if (depth_ && net_.holds[v] == SpringHold::kHeld) {
        if (const auto foot = depth_->Find(at, NetNormal(net_, static_cast<int>(v)), match)) {
          round.Hold(v, *foot);
        }
      }
      if (bone_) {
        round.KeepOut(v, FootOnBone(at), options_.clearance_mm);
      }
    }
  }

  Correspondence FootOnBone(const Vec3& p) const {
    const MeshPoint at = bone_->query().Closest(p);
    return {at, bone_->NormalAt(at)};
  }

  void Measure(const std::vector<double>& before, const std::vector<double>& after) {
    constexpr const char* kTerms[] = {"springs", "depth", "bone"};
    if (summary_.terms.empty()) {
      for (std::size_t k = 0; k < before.size(); ++k) {
        summary_.terms.push_back({.term = kTerms[k], .before = before[k], .after = kNaN});
      }
    }
    for (std::size_t k = 0; k < after.size(); ++k) {
      summary_.terms[k].after = after[k];
    }
  }

  static double LargestMove(const std::vector<Vec3>& from, const std::vector<Vec3>& to) {
    double most_mm = 0;
    for (std::size_t v = 0; v < from.size(); ++v) {
      most_mm = std::max(most_mm, (to[v] - from[v]).norm());
    }
    return most_mm;
  }

  // Moves vertices out of the bone that the springs have left in it.
  void PushOut() {
    summary_.pushed_out = 0;
    for (std::size_t v = 0; bone_ && v < net_.vertices.size(); ++v) {
      if (net_.holds[v] == SpringHold::kLocked) {
        continue;
      }
      const Correspondence foot = FootOnBone(net_.vertices[v]);
      if (foot.normal.dot(net_.vertices[v] - foot.point.position) < 0) {
        net_.vertices[v] = foot.point.position + options_.clearance_mm * foot.normal;
        ++summary_.pushed_out;
      }
    }
  }

  const SpringOptions& options_;
  SpringNet& net_;
  const std::vector<Vec3> start_;
  const std::vector<Spring> springs_;
  std::optional<Correspondences> depth_, bone_;
  SpringSummary summary_;
};

}  // namespace

SpringSummary RelaxSprings(const TriMesh& depth_mesh, const TriMesh& bone,
                           const SpringOptions& options, SpringNet& net,
                           const RunContext& context) {
  CheckNet(net);
  SpringRelaxer relaxer(depth_mesh, bone, options, net);
  while (relaxer.GoesOn()) {
    context.ThrowIfStopped();
    relaxer.Round();
  }
  return relaxer.Result();
}

}  // namespace semblance::fitting
