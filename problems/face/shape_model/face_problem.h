// SPDX-License-Identifier: GPL-3.0-or-later
// The ceres::Problem of a face. Its blocks are the pose (a similarity on its manifold), the
// coefficients and the smooth field of a face model, and the vertices of one level of the surface's
// deviation from the model. One engine serves two estimates: without vertices the estimate is that
// of the model alone (EstimateShape), and with them it is a step of a joint fit (SolveJointStep).
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "problems/face/shape_model/shape_model.h"
#include "problems/face/shape_model/shape_posterior.h"

namespace semblance::problems {

// A linear combination of vertices. Both members have the same size.
struct VertexSum {
  std::span<const int> index;
  std::span<const double> weight;
};

struct FaceProblemOptions {
  int max_iterations = 50;
  double function_tolerance = 1e-6;  // ends the solve when an iteration lowers the cost by less
  bool moves_pose_alone = false;     // all other blocks stay
};

struct FaceProblemSummary {
  int iterations = -1;
  std::string termination = "not run";
  bool usable = false;
};

// The costs of the solution are those of ShapeObservation and ShapePrior; a step of a joint fit
// (joint_fit.h) states them with the vertices.
class FaceProblem {
 public:
  // All three must outlive the problem, which changes parameters and vertices when it is solved.
  FaceProblem(const ShapeFrame& frame, ShapeParameters& parameters, std::span<Vec3> vertices = {});
  ~FaceProblem();

  // Begins a part: the residuals that are added next belong to it.
  void BeginPart(std::string_view name);

  // The observation of the model's point at seen.row, moved by the sum of vertices.
  void Observe(const ShapeObservation& seen, const VertexSum& vertices = {});
  // The cost |sum of vertices|^2.
  void AddVertexRow(const VertexSum& row);
  // The normal priors of pose, coefficients and field. `start`: the mean of the pose, apart from
  // ln s, whose mean is 0, the model's own size.
  void AddPriors(const ShapePrior& prior, const ShapePose& start);

  // The solver is dense without vertices and sparse with them. One thread.
  FaceProblemSummary Solve(const FaceProblemOptions& options);

  // The parts that have residuals, in their order.
  std::vector<std::string> Parts() const;
  // The cost of a part, with losses and weights.
  double Cost(std::string_view part);
  // The Jacobian of a part, times the roots of weights and losses; without rows if there is no such
  // part. Columns: a step of the pose (7), coefficients, field, then x, y and z of each vertex.
  Eigen::SparseMatrix<double> Jacobian(std::string_view part);

 private:
  struct Blocks;
  std::unique_ptr<Blocks> blocks_;
};

}  // namespace semblance::problems
