// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/face/joint_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "problems/face/shape_model/face_problem.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

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

// The problem of one step. Its vertices are those of R's level.
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
        parameters_(state.parameters),
        problem_(frame_, parameters_, net_.vertices) {
    problem_.BeginPart("dowels");
    Observe(data.dowels);
    problem_.BeginPart("seeds");
    Observe(data.seeds);
    problem_.BeginPart("marks");
    for (const ShapeObservation& mark : data.marks) {
      problem_.Observe(mark);
    }
    problem_.BeginPart("residual_field");
    for (const FieldRow& row :
         MakeFieldRows(PlaceVertices(model, level, state), weights.residual)) {
      problem_.AddVertexRow({row.index, row.weight});
    }
    problem_.BeginPart("face_model");
    problem_.AddPriors(weights.prior, weights.start_pose);
  }

  LevelSummary Solve(double function_tolerance) {
    LevelSummary summary;
    summary.level = level_;
    summary.free_vertices = static_cast<int>(net_.vertices.size());
    summary.solver = "ceres";
    for (const std::string& part : problem_.Parts()) {
      summary.terms.push_back({.term = part, .before = problem_.Cost(part), .after = kNaN});
    }
    const FaceProblemSummary solved =
        problem_.Solve({.max_iterations = 50, .function_tolerance = function_tolerance});
    for (TermCosts& term : summary.terms) {
      term.after = problem_.Cost(term.term);
    }
    summary.iterations = solved.iterations;
    summary.termination = solved.termination;
    summary.usable = solved.usable;
    return summary;
  }

  Eigen::SparseMatrix<double> Jacobian(std::string_view part) { return problem_.Jacobian(part); }

  // At the solution.
  const ControlNet& net() const { return net_; }
  const ShapeParameters& parameters() const { return parameters_; }

 private:
  // Takes what finer levels add to R off the positions.
  void Observe(const std::vector<SurfaceObservation>& seen) {
    for (const SurfaceObservation& one : seen) {
      const Stencil stencil = StencilAt(model_.shape, level_, one.uv);
      const Vec3 all = StencilAt(model_.shape, model_.shape.max_level, one.uv).Apply(finest_);
      problem_.Observe({.row = model_.RowAt(one.uv),
                        .position = one.position - (all - stencil.Apply(start_)),
                        .whitening = one.whitening,
                        .loss_width = one.loss_width,
                        .weight = one.weight},
                       {stencil.index, stencil.weight});
    }
  }

  const VertexModel& model_;
  const ControlNet& finest_;  // R at the start
  int level_;
  const ShapeFrame frame_;
  const ControlNet start_;  // of the level
  ControlNet net_;
  ShapeParameters parameters_;
  FaceProblem problem_;
};

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
  MoveDeviation(shape, summary.level, std::move(move), state);
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

void MoveDeviation(const HSplineShape& shape, int level, ControlNet move, JointState& state) {
  for (; level <= shape.max_level; ++level) {
    for (std::size_t k = 0; k < move.vertices.size(); ++k) {
      state.residual[level].vertices[k] += move.vertices[k];
    }
    move = level < shape.max_level ? Refine(shape, move, level) : move;
  }
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
                            JointState& state, double function_tolerance) {
  RequireLevel(step.level, model);
  const double rms_before_mm = ObservedRms_mm(model, data, state);
  JointStep joint(model, data, weights, step.level, state);
  LevelSummary summary = joint.Solve(function_tolerance);
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
