// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/shape_model/face_problem.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/normal_prior.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <ranges>
#include <utility>

#include "fitting/least_squares/sparse_factor.h"

namespace semblance::problems {
namespace {

using BlockRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr std::size_t kPoseSize = std::tuple_size_v<ShapePose>;

// The sizes of the model's blocks: the pose, then coefficients and field in short parts. Ceres
// computes only one half of the symmetric normal matrix block by block, but all of each block on
// its diagonal. So a long vector takes twice the time if it is one block.
std::vector<int> ModelBlockSizes(std::size_t modes, std::size_t field) {
  constexpr std::size_t kLargest = 32;
  std::vector<int> sizes = {kPoseSize};
  for (std::size_t left : {modes, field}) {
    for (; left > 0; left -= static_cast<std::size_t>(sizes.back())) {
      sizes.push_back(static_cast<int>(std::min(left, kLargest)));
    }
  }
  return sizes;
}

// Residual whitening (sum_k weight_k r_k + model(pose, w, a) - position). Blocks: those of the
// model, then the vertices r_k.
class PointCost final : public ceres::CostFunction {
 public:
  // frame must outlive the cost.
  PointCost(const ShapeFrame& frame, const ShapeObservation& seen, std::span<const double> weights)
      : frame_(frame),
        row_(seen.row),
        weights_(weights.begin(), weights.end()),
        position_(seen.position),
        whitening_(seen.whitening) {
    set_num_residuals(static_cast<int>(whitening_.rows()));
    std::vector<int>& sizes = *mutable_parameter_block_sizes();
    sizes = ModelBlockSizes(row_.modes.cols(), 3 * row_.field.size());
    model_blocks_ = sizes.size();
    sizes.insert(sizes.end(), weights_.size(), 3);
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t modes = row_.modes.cols(), field = 3 * row_.field.size();
    const std::vector<double> values = Joined(parameters);
    const std::span<const double> all(values), pose = all.first(kPoseSize);
    ShapeDerivatives derivatives;
    Vec3 point = PlacedPoint(frame_, row_, pose, all.subspan(kPoseSize, modes),
                             all.subspan(kPoseSize + modes, field), &derivatives);
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      point += weights_[k] * Eigen::Map<const Vec3>(parameters[model_blocks_ + k]);
    }
    Eigen::Map<Eigen::VectorXd>(residuals, whitening_.rows()) = whitening_ * (point - position_);
    if (jacobians != nullptr) {
      WriteModelJacobian(pose, derivatives, jacobians);
      WriteVertexJacobian(jacobians + model_blocks_);
    }
    return true;
  }

 private:
  // The values of the model's blocks in one vector.
  std::vector<double> Joined(const double* const* blocks) const {
    std::vector<double> values;
    for (std::size_t k = 0; k < model_blocks_; ++k) {
      values.insert(values.end(), blocks[k], blocks[k] + parameter_block_sizes()[k]);
    }
    return values;
  }

  void WriteModelJacobian(std::span<const double> pose, const ShapeDerivatives& derivatives,
                          double** jacobians) const {
    const Eigen::Index rows = whitening_.rows();
    Eigen::MatrixXd all(rows, 7 + row_.modes.cols() + 3 * row_.field.size());
    for (Eigen::Index r = 0; r < rows; ++r) {
      all.row(r) = DerivativeAlong(whitening_.row(r).transpose(), row_, derivatives);
    }
    if (jacobians[0] != nullptr) {
      Eigen::Map<BlockRows>(jacobians[0], rows, kPoseSize) =
          all.leftCols<7>() * PoseStepDerivative(pose);
    }
    Eigen::Index begin = 7;
    for (std::size_t k = 1; k < model_blocks_; ++k) {
      const int size = parameter_block_sizes()[k];
      if (jacobians[k] != nullptr) {
        Eigen::Map<BlockRows>(jacobians[k], rows, size) = all.middleCols(begin, size);
      }
      begin += size;
    }
  }

  void WriteVertexJacobian(double** jacobians) const {
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<BlockRows>(jacobians[k], whitening_.rows(), 3) = weights_[k] * whitening_;
      }
    }
  }

  const ShapeFrame& frame_;
  const ShapeRow row_;
  const std::vector<double> weights_;  // of the vertices
  const Vec3 position_;
  const Eigen::Matrix<double, Eigen::Dynamic, 3> whitening_;
  std::size_t model_blocks_ = 0;
};

// Residual sum_k weight_k r_k.
class VertexCost final : public ceres::CostFunction {
 public:
  explicit VertexCost(std::span<const double> weights) : weights_(weights.begin(), weights.end()) {
    set_num_residuals(3);
    mutable_parameter_block_sizes()->assign(weights_.size(), 3);
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Vec3> sum(residuals);
    sum.setZero();
    for (std::size_t k = 0; k < weights_.size(); ++k) {
      sum += weights_[k] * Eigen::Map<const Vec3>(parameters[k]);
      if (jacobians != nullptr && jacobians[k] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{jacobians[k]} =
            weights_[k] * Mat3::Identity();
      }
    }
    return true;
  }

 private:
  std::vector<double> weights_;
};

// Residual: the step from the start of the pose, over its standard deviations.
struct PosePrior {
  ShapePose start;
  PoseStep precision;

  template <class T>
  bool operator()(const T* const pose, T* residuals) const {
    const std::array<T, 4> back = {T(start[1]), T(-start[2]), T(-start[3]), T(-start[4])};
    std::array<T, 4> turn;
    ceres::QuaternionProduct(pose + 1, back.data(), turn.data());
    residuals[0] = pose[0];
    ceres::QuaternionToAngleAxis(turn.data(), residuals + 1);
    for (int k = 0; k < 3; ++k) {
      residuals[4 + k] = pose[5 + k] - start[5 + k];
    }
    for (int k = 0; k < 7; ++k) {
      residuals[k] *= precision[k];
    }
    return true;
  }
};

}  // namespace

struct FaceProblem::Blocks {
  // A group of residual blocks.
  struct Part {
    std::string name;
    std::vector<ceres::ResidualBlockId> residuals;
  };

  const ShapeFrame& frame;
  const ShapeParameters& parameters;
  std::span<Vec3> vertices;
  std::vector<double*> model;  // one per block
  std::vector<int> sizes;
  ceres::Problem problem;
  std::vector<Part> parts;

  Blocks(const ShapeFrame& the_frame, ShapeParameters& p, std::span<Vec3> the_vertices)
      : frame(the_frame),
        parameters(p),
        vertices(the_vertices),
        sizes(ModelBlockSizes(static_cast<std::size_t>(p.coefficients.size()),
                              static_cast<std::size_t>(p.field.size()))) {
    model.push_back(p.pose.data());
    problem.AddParameterBlock(model[0], sizes[0], MakePoseManifold());
    Eigen::Index begin = 0;  // in the coefficients, followed by the field
    for (const int size : sizes | std::views::drop(1)) {
      const Eigen::Index in_field = begin - p.coefficients.size();
      model.push_back(in_field < 0 ? p.coefficients.data() + begin : p.field.data() + in_field);
      problem.AddParameterBlock(model.back(), size);
      begin += size;
    }
    for (Vec3& vertex : vertices) {
      problem.AddParameterBlock(vertex.data(), 3);
    }
  }

  void Add(ceres::CostFunction* cost, ceres::LossFunction* loss,
           const std::vector<double*>& of_cost) {
    parts.back().residuals.push_back(problem.AddResidualBlock(cost, loss, of_cost));
  }

  void AppendVertices(const VertexSum& sum, std::vector<double*>& of_cost) const {
    for (const int vertex : sum.index) {
      of_cost.push_back(vertices[vertex].data());
    }
  }

  const Part* Find(std::string_view name) const {
    const auto part = std::ranges::find(parts, name, &Part::name);
    return part == parts.end() || part->residuals.empty() ? nullptr : &*part;
  }
};

FaceProblem::FaceProblem(const ShapeFrame& frame, ShapeParameters& parameters,
                         std::span<Vec3> vertices)
    : blocks_(std::make_unique<Blocks>(frame, parameters, vertices)) {}

FaceProblem::~FaceProblem() = default;

void FaceProblem::BeginPart(std::string_view name) {
  blocks_->parts.push_back({std::string(name), {}});
}

void FaceProblem::Observe(const ShapeObservation& seen, const VertexSum& vertices) {
  auto* const loss = new ceres::ScaledLoss(new ceres::HuberLoss(seen.loss_width), seen.weight,
                                           ceres::TAKE_OWNERSHIP);
  std::vector<double*> of_cost = blocks_->model;
  blocks_->AppendVertices(vertices, of_cost);
  blocks_->Add(new PointCost(blocks_->frame, seen, vertices.weight), loss, of_cost);
}

void FaceProblem::AddVertexRow(const VertexSum& row) {
  std::vector<double*> of_cost;
  blocks_->AppendVertices(row, of_cost);
  blocks_->Add(new VertexCost(row.weight), nullptr, of_cost);
}

void FaceProblem::AddPriors(const ShapePrior& prior, const ShapePose& start) {
  const std::vector<double*>& model = blocks_->model;
  const std::vector<int>& sizes = blocks_->sizes;
  const Eigen::VectorXd precision = prior.Deviations(blocks_->parameters).cwiseInverse();
  auto* const of_pose = new ceres::AutoDiffCostFunction<PosePrior, 7, kPoseSize>(
      new PosePrior{start, precision.head<7>()});
  blocks_->Add(of_pose, nullptr, {model[0]});
  Eigen::Index begin = 7;
  for (std::size_t k = 1; k < model.size(); ++k) {
    const Eigen::MatrixXd root = precision.segment(begin, sizes[k]).asDiagonal();
    blocks_->Add(new ceres::NormalPrior(root, Eigen::VectorXd::Zero(sizes[k])), nullptr,
                 {model[k]});
    begin += sizes[k];
  }
}

FaceProblemSummary FaceProblem::Solve(const FaceProblemOptions& options) {
  for (double* const block : blocks_->model | std::views::drop(1)) {
    if (options.moves_pose_alone) {
      blocks_->problem.SetParameterBlockConstant(block);
    }
  }
  fitting::UseOneLibraryThread();
  ceres::Solver::Options solver;
  solver.linear_solver_type =
      blocks_->vertices.empty() ? ceres::DENSE_NORMAL_CHOLESKY : ceres::SPARSE_NORMAL_CHOLESKY;
  solver.num_threads = 1;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = options.function_tolerance;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(solver, &blocks_->problem, &solved);
  return {.iterations = static_cast<int>(solved.iterations.size()) - 1,
          .termination = ceres::TerminationTypeToString(solved.termination_type),
          .usable = solved.IsSolutionUsable()};
}

std::vector<std::string> FaceProblem::Parts() const {
  std::vector<std::string> names;
  for (const Blocks::Part& part : blocks_->parts) {
    if (!part.residuals.empty()) {
      names.push_back(part.name);
    }
  }
  return names;
}

double FaceProblem::Cost(std::string_view part) {
  const Blocks::Part* const found = blocks_->Find(part);
  if (found == nullptr) {
    return 0;
  }
  ceres::Problem::EvaluateOptions options;
  options.residual_blocks = found->residuals;
  double half = kNaN;
  blocks_->problem.Evaluate(options, &half, nullptr, nullptr, nullptr);
  return 2 * half;
}

Eigen::SparseMatrix<double> FaceProblem::Jacobian(std::string_view part) {
  const Blocks::Part* const found = blocks_->Find(part);
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks_->model;
  for (Vec3& vertex : blocks_->vertices) {
    options.parameter_blocks.push_back(vertex.data());
  }
  if (found == nullptr) {
    const int model = std::accumulate(blocks_->sizes.begin(), blocks_->sizes.end(), -1);
    return Eigen::SparseMatrix<double>(0, model + 3 * std::ssize(blocks_->vertices));
  }
  options.residual_blocks = found->residuals;
  ceres::CRSMatrix rows;
  blocks_->problem.Evaluate(options, nullptr, nullptr, nullptr, &rows);
  return Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
      rows.num_rows, rows.num_cols, std::ssize(rows.values), rows.rows.data(), rows.cols.data(),
      rows.values.data());
}

}  // namespace semblance::problems
