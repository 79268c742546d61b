// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/joint_fit.h"

#include <ceres/cost_function.h>
#include <ceres/crs_matrix.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "problems/face/shape_model/shape_cost.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using BlockRows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Residual whitening (sum_k weight_k r_k + model(pose, w, a) + detail - position). Blocks: those of
// the model's parameters (ShapeBlocks), then the deviations r_k of sixteen vertices.
class SurfaceCost final : public ceres::CostFunction {
 public:
  // detail: what finer levels add to R there. frame must outlive the cost.
  SurfaceCost(const ShapeFrame& frame, ShapeRow row, const Stencil& stencil,
              const SurfaceObservation& seen, const Vec3& detail)
      : frame_(frame),
        row_(std::move(row)),
        stencil_(stencil),
        position_(seen.position - detail),
        whitening_(seen.whitening) {
    set_num_residuals(static_cast<int>(whitening_.rows()));
    std::vector<int>& sizes = *mutable_parameter_block_sizes();
    sizes = ShapeBlockSizes(row_.modes.cols(), 3 * row_.field.size());
    first_vertex_ = sizes.size();
    sizes.insert(sizes.end(), 16, 3);
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t modes = row_.modes.cols(), field = 3 * row_.field.size();
    const Eigen::VectorXd values = JoinShapeBlocks(ModelBlocks(), parameters);
    ShapeDerivatives derivatives;
    Vec3 point = PlacedPoint(frame_, row_, {values.data(), 7}, {values.data() + 7, modes},
                             {values.data() + 7 + modes, field}, &derivatives);
    for (int k = 0; k < 16; ++k) {
      point += stencil_.weight[k] * Eigen::Map<const Vec3>(parameters[first_vertex_ + k]);
    }
    const Eigen::Index rows = whitening_.rows();
    Eigen::Map<Eigen::VectorXd>(residuals, rows) = whitening_ * (point - position_);
    if (jacobians != nullptr) {
      WriteModelJacobian(derivatives, jacobians);
      WriteVertexJacobian(jacobians + first_vertex_);
    }
    return true;
  }

 private:
  // Their sizes.
  std::span<const int> ModelBlocks() const {
    return std::span(parameter_block_sizes()).first(first_vertex_);
  }

  void WriteModelJacobian(const ShapeDerivatives& derivatives, double** jacobians) const {
    Eigen::MatrixXd all(whitening_.rows(), 7 + row_.modes.cols() + 3 * row_.field.size());
    for (Eigen::Index r = 0; r < whitening_.rows(); ++r) {
      all.row(r) = DerivativeAlong(whitening_.row(r).transpose(), row_, derivatives);
    }
    WriteShapeJacobian(all, ModelBlocks(), jacobians);
  }

  void WriteVertexJacobian(double** jacobians) const {
    for (int k = 0; k < 16; ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<BlockRows>(jacobians[k], whitening_.rows(), 3) = stencil_.weight[k] * whitening_;
      }
    }
  }

  const ShapeFrame& frame_;
  ShapeRow row_;
  Stencil stencil_;
  Vec3 position_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> whitening_;
  std::size_t first_vertex_ = 0;
};

// Residual sum_k weight_k r_k of a row of the residual field.
class FieldCost final : public ceres::CostFunction {
 public:
  explicit FieldCost(std::vector<double> weights) : weights_(std::move(weights)) {
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

// The points of the face at the Greville points of a level. The outermost vertices have theirs
// beyond the domain; they are placed on the lines through the two next ones.
ControlNet PlaceVertices(const VertexModel& model, int level, const JointState& state) {
  ControlNet places = state.residual[level];
  const int columns = places.columns, rows = places.rows;
  for (int k = 0; k < columns * rows; ++k) {
    const Vec2 uv = GrevillePoint(model.shape, {level, k % columns, k / columns});
    places.vertices[k] = state.Point(model, uv);
  }
  const auto extend = [](Vec3& outer, const Vec3& next, const Vec3& inner) {
    outer = 2 * next - inner;
  };
  for (int j = 0; j < rows; ++j) {
    extend(places.At(0, j), places.At(1, j), places.At(2, j));
    extend(places.At(columns - 1, j), places.At(columns - 2, j), places.At(columns - 3, j));
  }
  for (int i = 0; i < columns; ++i) {
    extend(places.At(i, 0), places.At(i, 1), places.At(i, 2));
    extend(places.At(i, rows - 1), places.At(i, rows - 2), places.At(i, rows - 3));
  }
  return places;
}

// The problem of one step. Its blocks are the vertices of R's level and the parameters.
class JointStep {
 public:
  JointStep(const VertexModel& model, const JointData& data, const JointWeights& weights, int level,
            const JointState& state)
      : model_(model),
        finest_(state.residual.back()),
        level_(level),
        frame_(state.frame),
        start_(state.residual[level]),
        net_(start_),
        parameters_(state.parameters) {
    Add("dowels", [&] { AddObservations(data.dowels); });
    Add("seeds", [&] { AddObservations(data.seeds); });
    Add("marks", [&] { AddMarks(data.marks); });
    Add("residual_field", [&] {
      AddResidualField(MakeFieldRows(PlaceVertices(model, level, state), weights.residual));
    });
    Add("face_model",
        [&] { AddShapePriors(weights.prior, weights.start_pose, parameters_, problem_); });
  }

  LevelSummary Solve() {
    LevelSummary summary;
    summary.level = level_;
    summary.free_vertices = static_cast<int>(net_.vertices.size());
    summary.solver = "ceres";
    for (const Part& part : parts_) {
      summary.terms.push_back(
          {.term = std::string(part.name), .before = Cost(part), .after = kNaN});
    }
    const ceres::Solver::Summary solved = RunCeres();
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      summary.terms[k].after = Cost(parts_[k]);
    }
    summary.iterations = static_cast<int>(solved.iterations.size()) - 1;
    summary.termination = ceres::TerminationTypeToString(solved.termination_type);
    summary.usable = solved.IsSolutionUsable();
    return summary;
  }

  // The Jacobian of a part of the problem; without rows if there is no such part.
  Eigen::SparseMatrix<double> Jacobian(std::string_view name) {
    ceres::Problem::EvaluateOptions options;
    options.parameter_blocks = ShapeBlocks(parameters_);
    for (Vec3& vertex : net_.vertices) {
      options.parameter_blocks.push_back(vertex.data());
    }
    const auto part = std::ranges::find(parts_, name, &Part::name);
    if (part == parts_.end()) {
      return Eigen::SparseMatrix<double>(0, parameters_.size() + 3 * std::ssize(net_.vertices));
    }
    options.residual_blocks = part->blocks;
    ceres::CRSMatrix rows;
    problem_.Evaluate(options, nullptr, nullptr, nullptr, &rows);
    return Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>>(
        rows.num_rows, rows.num_cols, std::ssize(rows.values), rows.rows.data(), rows.cols.data(),
        rows.values.data());
  }

  // At the solution.
  const ControlNet& net() const { return net_; }
  const ShapeParameters& parameters() const { return parameters_; }

 private:
  // A group of residual blocks, and its name in the summary.
  struct Part {
    std::string_view name;
    std::vector<ceres::ResidualBlockId> blocks;
  };

  // Runs `add`, and makes a part of the residual blocks that it added, if there are some.
  void Add(const char* name, const auto& add) {
    std::vector<ceres::ResidualBlockId> before, after;
    problem_.GetResidualBlocks(&before);
    add();
    problem_.GetResidualBlocks(&after);
    if (after.size() > before.size()) {
      parts_.push_back({name, {after.begin() + std::ssize(before), after.end()}});
    }
  }

  void AddObservations(const std::vector<SurfaceObservation>& seen) {
    for (const SurfaceObservation& one : seen) {
      const Stencil stencil = StencilAt(model_.shape, level_, one.uv);
      const Vec3 all = StencilAt(model_.shape, model_.shape.max_level, one.uv).Apply(finest_);
      std::vector<double*> blocks = ShapeBlocks(parameters_);
      for (const int vertex : stencil.index) {
        blocks.push_back(net_.vertices[vertex].data());
      }
      problem_.AddResidualBlock(
          new SurfaceCost(frame_, model_.RowAt(one.uv), stencil, one, all - stencil.Apply(start_)),
          MakeLoss(one.loss_width, one.weight), blocks);
    }
  }

  void AddMarks(const std::vector<ShapeObservation>& marks) {
    for (const ShapeObservation& mark : marks) {
      problem_.AddResidualBlock(MakeShapeCost(frame_, mark), MakeLoss(mark.loss_width, mark.weight),
                                ShapeBlocks(parameters_));
    }
  }

  void AddResidualField(std::vector<FieldRow> rows) {
    for (FieldRow& row : rows) {
      std::vector<double*> blocks;
      for (const int vertex : row.index) {
        blocks.push_back(net_.vertices[vertex].data());
      }
      problem_.AddResidualBlock(new FieldCost(std::move(row.weight)), nullptr, blocks);
    }
  }

  static ceres::LossFunction* MakeLoss(double width, double weight) {
    return new ceres::ScaledLoss(new ceres::HuberLoss(width), weight, ceres::TAKE_OWNERSHIP);
  }

  ceres::Solver::Summary RunCeres() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.num_threads = 1;
    options.max_num_iterations = 50;
    // Rotation and losses are not linear, so steps converge linearly. A smaller tolerance takes
    // twice as many iterations and moves no vertex by 0.01 mm, and the next step starts again.
    options.function_tolerance = 1e-7;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary;
  }

  // Ceres' cost is half of ours.
  double Cost(const Part& part) {
    ceres::Problem::EvaluateOptions options;
    options.residual_blocks = part.blocks;
    double cost = kNaN;
    problem_.Evaluate(options, &cost, nullptr, nullptr, nullptr);
    return 2 * cost;
  }

  const VertexModel& model_;
  const ControlNet& finest_;  // R at the start
  int level_;
  const ShapeFrame frame_;
  const ControlNet start_;  // of the level
  ControlNet net_;
  ShapeParameters parameters_;
  ceres::Problem problem_;
  std::vector<Part> parts_;
};

// from + fraction (to - from).
ShapeParameters PartOfWay(const ShapeParameters& from, const ShapeParameters& to, double fraction) {
  ShapeParameters part = from;
  for (std::size_t k = 0; k < part.pose.size(); ++k) {
    part.pose[k] += fraction * (to.pose[k] - from.pose[k]);
  }
  part.coefficients += fraction * (to.coefficients - from.coefficients);
  part.field += fraction * (to.field - from.field);
  return part;
}

// Moves the level's vertices by the fraction of the way, and the finer nets along.
void MoveTowards(const HSplineShape& shape, const ControlNet& solved, LevelSummary& summary,
                 JointState& state) {
  ControlNet move = solved;
  summary.max_move_mm = 0;
  summary.moved_vertices = 0;
  for (std::size_t k = 0; k < move.vertices.size(); ++k) {
    Vec3& by = move.vertices[k];
    by = summary.fraction * (by - state.residual[summary.level].vertices[k]);
    summary.max_move_mm = std::max(summary.max_move_mm, by.norm());
    summary.moved_vertices += by.norm() >= kLeastMove_mm ? 1 : 0;
  }
  for (int level = summary.level; level <= shape.max_level; ++level) {
    for (std::size_t k = 0; k < move.vertices.size(); ++k) {
      state.residual[level].vertices[k] += move.vertices[k];
    }
    move = level < shape.max_level ? Refine(shape, move, level) : move;
  }
}

// The weighted root mean square distance of the surface from dowels and seeds.
double ObservedRms_mm(const VertexModel& model, const JointData& data, const JointState& state) {
  double sum = 0, weights = 0;
  for (const auto* const list : {&data.dowels, &data.seeds}) {
    for (const SurfaceObservation& one : *list) {
      sum += one.weight * (state.Point(model, one.uv) - one.position).squaredNorm();
      weights += one.weight;
    }
  }
  return std::sqrt(sum / weights);
}

// The net of one vector per sample of the template's grid, which is that of a point of the model.
ControlNet NetOfModel(const FacePrior& prior, const PriorOnTemplate& on_template,
                      const HSplineShape& shape, const auto& value_at_vertex) {
  std::vector<Vec3> samples;
  samples.reserve(on_template.under.size());
  for (const ModelPoint& under : on_template.under) {
    const Triangle& t = prior.model.mean.triangles[under.triangle];
    samples.emplace_back(under.weights[0] * value_at_vertex(t[0]) +
                         under.weights[1] * value_at_vertex(t[1]) +
                         under.weights[2] * value_at_vertex(t[2]));
  }
  return NetThrough(shape, shape.max_level, on_template.grid, samples);
}

void AddModes(const FacePrior& prior, const auto& net_of, VertexModel& model) {
  for (Eigen::Index mode = 0; mode < prior.model.Modes(); ++mode) {
    const ControlNet net = net_of(
        [&](int v) -> Vec3 { return prior.model.modes.block<3, 1>(3 * Eigen::Index{v}, mode); });
    for (std::size_t i = 0; i < net.vertices.size(); ++i) {
      model.rows[i].modes.col(mode) = net.vertices[i];
    }
  }
}

// Three columns of the field at a time, as x, y and z of one net.
void AddField(const Eigen::MatrixXd& field, const auto& net_of, VertexModel& model) {
  for (Eigen::Index first = 0; first < field.cols(); first += 3) {
    const Eigen::Index count = std::min<Eigen::Index>(3, field.cols() - first);
    const ControlNet net = net_of([&](int v) -> Vec3 {
      Vec3 values = Vec3::Zero();
      values.head(count) = field.row(v).segment(first, count).transpose();
      return values;
    });
    for (std::size_t i = 0; i < net.vertices.size(); ++i) {
      model.rows[i].field.segment(first, count) = net.vertices[i].head(count).transpose();
    }
  }
}

}  // namespace

ShapeRow VertexModel::RowAt(const Vec2& uv) const {
  const Stencil stencil = StencilAt(shape, shape.max_level, uv);
  const ShapeRow& first = rows[stencil.index[0]];
  ShapeRow sum{Vec3::Zero(), Eigen::Matrix3Xd::Zero(3, first.modes.cols()),
               Eigen::RowVectorXd::Zero(first.field.size())};
  for (int k = 0; k < 16; ++k) {
    const ShapeRow& row = rows[stencil.index[k]];
    sum.mean += stencil.weight[k] * row.mean;
    sum.modes += stencil.weight[k] * row.modes;
    sum.field += stencil.weight[k] * row.field;
  }
  return sum;
}

VertexModel MakeVertexModel(const FacePrior& prior, const PriorOnTemplate& on_template,
                            const Eigen::MatrixXd& field, const HSplineShape& shape) {
  std::vector<Vec3> samples;
  for (std::size_t k = 0; k < on_template.under.size(); ++k) {
    samples.emplace_back(
        FindPosition(on_template.under[k], prior.model.mean, prior.model.mean.points) +
        on_template.beside[k]);
  }
  VertexModel model{.shape = shape, .rows = {}};
  for (const Vec3& vertex :
       NetThrough(shape, shape.max_level, on_template.grid, samples).vertices) {
    model.rows.push_back(
        {vertex, Eigen::Matrix3Xd(3, prior.model.Modes()), Eigen::RowVectorXd(field.cols())});
  }
  const auto net_of = [&](const auto& value) {
    return NetOfModel(prior, on_template, shape, value);
  };
  AddModes(prior, net_of, model);
  AddField(field, net_of, model);
  return model;
}

Vec3 JointState::Point(const VertexModel& model, const Vec2& uv) const {
  return PlacedPoint(frame, model.RowAt(uv), parameters) +
         StencilAt(model.shape, model.shape.max_level, uv).Apply(residual.back());
}

JointState StartJoint(const HSplineShape& shape, const ShapeFrame& frame,
                      const ShapeParameters& parameters) {
  JointState state{.residual = {}, .frame = frame, .parameters = parameters};
  for (int level = 0; level <= shape.max_level; ++level) {
    const int columns = shape.Columns(level), rows = shape.Rows(level);
    state.residual.push_back(
        {columns, rows, std::vector<Vec3>(static_cast<std::size_t>(columns) * rows, Vec3::Zero())});
  }
  return state;
}

namespace {

void RequireLevel(int level, const VertexModel& model) {
  if (level < 0 || level > model.shape.max_level) {
    throw InputError(fmt::format("joint fit: the face has no level {}; its levels are 0 to {}",
                                 level, model.shape.max_level));
  }
}

}  // namespace

JointRows LinearizeJointStep(const VertexModel& model, const JointData& data,
                             const JointWeights& weights, int level, const JointState& state) {
  RequireLevel(level, model);
  JointStep step(model, data, weights, level, state);
  return {.dowels = step.Jacobian("dowels"),
          .seeds = step.Jacobian("seeds"),
          .marks = step.Jacobian("marks"),
          .residual_field = step.Jacobian("residual_field"),
          .face_model = step.Jacobian("face_model")};
}

LevelSummary SolveJointStep(const VertexModel& model, const JointData& data,
                            const JointWeights& weights, const ScheduleStep& step,
                            JointState& state) {
  RequireLevel(step.level, model);
  const double rms_before_mm = ObservedRms_mm(model, data, state);
  JointStep joint(model, data, weights, step.level, state);
  LevelSummary summary = joint.Solve();
  summary.fraction = step.fraction;
  summary.rms_before_mm = rms_before_mm;
  if (summary.usable) {
    MoveTowards(model.shape, joint.net(), summary, state);
    state.parameters = PartOfWay(state.parameters, joint.parameters(), step.fraction);
  }
  summary.rms_after_mm = ObservedRms_mm(model, data, state);
  return summary;
}

}  // namespace semblance::problems
