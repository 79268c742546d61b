// SPDX-License-Identifier: GPL-3.0-or-later
#include <ceres/cost_function.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include "fitting/least_squares/linear_cost.h"
#include "fitting/terms/metric_distortion.h"
#include "fitting/terms/term_cost.h"

namespace semblance::fitting {
namespace {

const ControlNet& Anchor(const PriorTerm& term, const LevelView& view) {
  return term.towards == PriorTowards::kStart ? view.start : view.rest;
}

// Calls `use` with each vertex that the term holds.
void ForEach(const PriorTerm& term, const LevelView& view, const auto& use) {
  const std::size_t count = term.held_only ? view.held.size() : view.start.vertices.size();
  for (std::size_t k = 0; k < count; ++k) {
    use(term.held_only ? view.held[k] : static_cast<int>(k));
  }
}

}  // namespace

void AddRows(const PriorTerm& term, const LevelView& view, RowSink& sink) {
  const ControlNet& anchor = Anchor(term, view);
  const double factor = std::sqrt(term.weight / static_cast<double>(anchor.vertices.size()));
  const auto a = std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Constant(1, 1, factor));
  ForEach(term, view,
          [&](int k) { sink.Add(a, factor * anchor.vertices[k].transpose(), std::array{k}); });
}

double TermCost(const PriorTerm& term, const LevelView& view, const ControlNet& net) {
  const ControlNet& anchor = Anchor(term, view);
  double sum = 0;
  ForEach(term, view, [&](int k) { sum += (net.vertices[k] - anchor.vertices[k]).squaredNorm(); });
  return term.weight * sum / static_cast<double>(net.vertices.size());
}

namespace {

// The sixteen vertices at which the energy is zero: the template's, or zeros.
PatchMatrix Origin(SmoothnessOf of, const SplineElement& element) {
  return of == SmoothnessOf::kSurface ? PatchMatrix(PatchMatrix::Zero()) : element.rest;
}

// Calls `use` with each element, its stiffness, and a root of the stiffness that elements of one
// level share.
void ForEachElement(const auto& term, const LevelView& view, const auto& use) {
  std::shared_ptr<const Eigen::MatrixXd> root;
  ElementStiffness stiffness;
  int patches_u = -1;
  for (int e = 0; e < view.elements(); ++e) {
    const SplineElement element = view.Element(e);
    if (element.patches_u != patches_u) {
      patches_u = element.patches_u;
      stiffness = PatchStiffness(term, view.lengths_mm, patches_u, element.patches_v);
      root = std::make_shared<const Eigen::MatrixXd>(StiffnessRoot(stiffness));
    }
    use(element, stiffness, root);
  }
}

void AddEnergy(const auto& term, const LevelView& view, RowSink& sink) {
  ForEachElement(term, view,
                 [&](const SplineElement& element, const ElementStiffness&,
                     const std::shared_ptr<const Eigen::MatrixXd>& root) {
                   AddElementRows(element, root, *root * Origin(term.of, element), sink);
                 });
}

double Energy(const auto& term, const LevelView& view, const ControlNet& net) {
  double energy = 0;
  ForEachElement(term, view,
                 [&](const SplineElement& element, const ElementStiffness& stiffness, const auto&) {
                   const PatchMatrix x = element.Vertices(net) - Origin(term.of, element);
                   energy += (stiffness * x).cwiseProduct(x).sum();
                 });
  return energy;
}

}  // namespace

// weight * length^4 / area * energy of a patch.
ElementStiffness PatchStiffness(const SmoothnessTerm& term, const Vec2& lengths_mm, int patches_u,
                                int patches_v) {
  const double scale = term.weight * std::pow(term.length_mm, 4) / lengths_mm.prod();
  return scale * ThinPlateStiffness(lengths_mm.x() / patches_u, lengths_mm.y() / patches_v,
                                    MakeBendingMetric({.stretch = term.stretch,
                                                       .direction_deg = term.direction_deg}));
}

// weight * length^2 / area * energy of a patch.
ElementStiffness PatchStiffness(const MembraneTerm& term, const Vec2& lengths_mm, int patches_u,
                                int patches_v) {
  const double scale = term.weight * std::pow(term.length_mm, 2) / lengths_mm.prod();
  return scale * MembraneStiffness(lengths_mm.x() / patches_u, lengths_mm.y() / patches_v);
}

void AddRows(const SmoothnessTerm& term, const LevelView& view, RowSink& sink) {
  AddEnergy(term, view, sink);
}

void AddRows(const MembraneTerm& term, const LevelView& view, RowSink& sink) {
  AddEnergy(term, view, sink);
}

double TermCost(const SmoothnessTerm& term, const LevelView& view, const ControlNet& net) {
  return Energy(term, view, net);
}

double TermCost(const MembraneTerm& term, const LevelView& view, const ControlNet& net) {
  return Energy(term, view, net);
}

VertexId MirrorVertex(const HSplineShape& shape, const VertexId& vertex) {
  const int columns = shape.Columns(vertex.level);
  const int mirrored =
      shape.ClosedU() ? (columns + 2 - vertex.i) % columns : columns - 1 - vertex.i;
  return {vertex.level, mirrored, vertex.j};
}

namespace {

// A control vertex of an element as a weighted sum of the unknowns.
struct Control {
  int twin = -1;     // index of its mirror
  double share = 1;  // relative share of the domain
  Vec3 rest = Vec3::Zero(), fixed = Vec3::Zero();
  std::vector<int> dofs;
  Eigen::RowVectorXd weights;

  Vec3 At(const ControlNet& net) const {
    Vec3 sum = fixed;
    for (std::size_t k = 0; k < dofs.size(); ++k) {
      sum += weights[static_cast<Eigen::Index>(k)] * net.vertices[dofs[k]];
    }
    return sum;
  }
};

Control MakeControl(const SplineElement& element, int k) {
  Control control{.share = std::pow(0.25, element.patch.level),
                  .rest = element.rest.row(k),
                  .fixed = element.fixed.row(k),
                  .dofs = element.dofs,
                  .weights = {}};
  if (element.IsIdentity()) {
    control.dofs = {element.dofs[k]};
    control.weights = Eigen::RowVectorXd::Ones(1);
  } else {
    control.weights = element.extraction.row(k);
  }
  return control;
}

// Every vertex of every patch's own level, each once.
std::vector<Control> MakeControls(const LevelView& view) {
  const HSplineShape shape = view.space != nullptr ? view.space->shape() : view.grid.Shape();
  std::map<VertexId, int> index;
  std::vector<Control> controls;
  for (int e = 0; e < view.elements(); ++e) {
    const SplineElement element = view.Element(e);
    const PatchId& p = element.patch;
    for (int k = 0; k < 16; ++k) {
      const VertexId vertex{p.level, shape.Column(p.level, p.i + k % 4), p.j + k / 4};
      if (index.try_emplace(vertex, static_cast<int>(controls.size())).second) {
        controls.push_back(MakeControl(element, k));
      }
    }
  }
  for (const auto& [vertex, k] : index) {
    controls[k].twin = index.at(MirrorVertex(shape, vertex));
  }
  return controls;
}

double ShareSum(const std::vector<Control>& controls) {
  double sum = 0;
  for (const Control& control : controls) {
    sum += control.share;
  }
  return sum;
}

struct Mirror {
  Vec3 point = Vec3::Zero();  // on the plane
  Mat3 reflection = Mat3::Identity();
};

// The reflection that maps the template's vertices best to their mirrors. Its normal n minimises n
// . sum_k x_k y_k^T n, where x_k and y_k are a vertex and its mirror, relative to the common
// centre.
Mirror FitMirror(const std::vector<Control>& controls) {
  const double all = ShareSum(controls);
  Mirror mirror;
  for (const Control& control : controls) {
    mirror.point += control.share / all * control.rest;
  }
  Mat3 sum = Mat3::Zero();
  for (const Control& control : controls) {
    const Vec3& twin = controls[control.twin].rest;
    sum += control.share * (control.rest - mirror.point) * (twin - mirror.point).transpose();
  }
  const Mat3 symmetric = sum + sum.transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(symmetric);
  const Vec3 normal = eigen.eigenvectors().col(0);
  mirror.reflection -= 2 * normal * normal.transpose();
  return mirror;
}

// The place at which a vertex's f is zero.
Vec3 Origin(const SymmetryTerm& term, const Mirror& mirror, const Control& control) {
  return term.of == SmoothnessOf::kDisplacement ? control.rest : mirror.point;
}

}  // namespace

// Both vertices of a pair have the same misfit, so one residual counts for both.
void AddResiduals(const SymmetryTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  const std::vector<Control> controls = MakeControls(view);
  const Mirror mirror = FitMirror(controls);
  const double all = ShareSum(controls);
  for (int k = 0; k < static_cast<int>(controls.size()); ++k) {
    const Control &control = controls[k], &twin = controls[control.twin];
    if (control.twin < k) {
      continue;
    }
    const double factor =
        std::sqrt((control.twin == k ? 1 : 2) * term.weight * control.share / all);
    const Eigen::Index own = control.weights.size();
    Eigen::MatrixXd a(3, 3 * (own + twin.weights.size()));
    for (Eigen::Index d = 0; d < own; ++d) {
      a.middleCols<3>(3 * d) = factor * control.weights[d] * Mat3::Identity();
    }
    for (Eigen::Index d = 0; d < twin.weights.size(); ++d) {
      a.middleCols<3>(3 * (own + d)) = -factor * twin.weights[d] * mirror.reflection;
    }
    const Vec3 f = control.fixed - Origin(term, mirror, control),
               g = twin.fixed - Origin(term, mirror, twin);
    std::vector<int> dofs = control.dofs;
    dofs.insert(dofs.end(), twin.dofs.begin(), twin.dofs.end());
    AddCoupledResidual(a, -factor * (f - mirror.reflection * g), dofs, net, problem);
  }
}

double TermCost(const SymmetryTerm& term, const LevelView& view, const ControlNet& net) {
  const std::vector<Control> controls = MakeControls(view);
  const Mirror mirror = FitMirror(controls);
  double sum = 0;
  for (const Control& control : controls) {
    const Control& twin = controls[control.twin];
    const Vec3 f = control.At(net) - Origin(term, mirror, control),
               g = twin.At(net) - Origin(term, mirror, twin);
    sum += control.share * (f - mirror.reflection * g).squaredNorm();
  }
  return term.weight * sum / ShareSum(controls);
}

namespace {

// A Gauss point (2 x 2 per patch) at which the template has tangents.
struct Sample {
  SplineElement element;
  std::array<double, 16> x1{}, x2{};  // weights that give the images of the template's axes, 1/mm
  double area = kNaN;                 // relative area of the template
};

using Weights = std::array<double, 16>;

Vec3 Applied(const Weights& weights, const PatchMatrix& vertices) {
  return (Eigen::Map<const Eigen::Matrix<double, 1, 16>>(weights.data()) * vertices).transpose();
}

void AddSamples(const LevelView& view, const SplineElement& element, std::vector<Sample>& samples) {
  for (int k = 0; k < 4; ++k) {
    const Vec2 in_patch = GaussPoint(k, 1, 1);
    const Vec2 uv((element.patch.i + in_patch.x()) / element.patches_u,
                  (element.patch.j + in_patch.y()) / element.patches_v);
    const Weights du = view.LocalAt(uv, {1, 0}).weight, dv = view.LocalAt(uv, {0, 1}).weight;
    const auto axes = TemplateAxes::At(Applied(du, element.rest), Applied(dv, element.rest));
    if (!axes) {
      continue;
    }
    Sample& sample = samples.emplace_back();
    sample.element = element;
    sample.area = axes->area / element.patches_u / element.patches_v;
    for (int v = 0; v < 16; ++v) {
      sample.x1[v] = axes->a1 * du[v];
      sample.x2[v] = axes->a2 * du[v] + axes->b2 * dv[v];
    }
  }
}

std::vector<Sample> MakeSamples(const LevelView& view) {
  std::vector<Sample> samples;
  for (int e = 0; e < view.elements(); ++e) {
    AddSamples(view, view.Element(e), samples);
  }
  return samples;
}

// Turns weights of an element's vertices into weights of its dofs.
Eigen::VectorXd OverDofs(const Weights& weights, const SplineElement& element) {
  const Eigen::Map<const Eigen::Matrix<double, 16, 1>> local(weights.data());
  return element.IsIdentity() ? Eigen::VectorXd(local)
                              : Eigen::VectorXd(element.extraction.transpose() * local);
}

double AreaSum(const std::vector<Sample>& samples) {
  double sum = 0;
  for (const Sample& sample : samples) {
    sum += sample.area;
  }
  return sum;
}

// Residual factor (e11, e22, sqrt(2) e12), or factor (area / template's area - 1).
class DistortionCost final : public ceres::CostFunction {
 public:
  DistortionCost(const Sample& sample, DistortionOf of, double factor)
      : x1_(OverDofs(sample.x1, sample.element)),
        x2_(OverDofs(sample.x2, sample.element)),
        fixed_x1_(Applied(sample.x1, sample.element.fixed)),
        fixed_x2_(Applied(sample.x2, sample.element.fixed)),
        of_(of),
        factor_(factor) {
    mutable_parameter_block_sizes()->assign(sample.element.dofs.size(), 3);
    set_num_residuals(of == DistortionOf::kMetric ? 3 : 1);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Vec3 x1 = fixed_x1_, x2 = fixed_x2_;
    for (int k = 0; k < x1_.size(); ++k) {
      x1 += x1_[k] * Eigen::Map<const Vec3>(parameters[k]);
      x2 += x2_[k] * Eigen::Map<const Vec3>(parameters[k]);
    }
    of_ == DistortionOf::kMetric ? Metric(x1, x2, residuals, jacobians)
                                 : Area(x1, x2, residuals, jacobians);
    return true;
  }

 private:
  void Metric(const Vec3& x1, const Vec3& x2, double* residuals, double** jacobians) const {
    const double root = std::numbers::sqrt2;
    residuals[0] = factor_ * (x1.squaredNorm() - 1) / 2;
    residuals[1] = factor_ * (x2.squaredNorm() - 1) / 2;
    residuals[2] = factor_ * x1.dot(x2) / root;
    for (int k = 0; jacobians != nullptr && k < x1_.size(); ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> j(jacobians[k]);
        j.row(0) = factor_ * x1_[k] * x1;
        j.row(1) = factor_ * x2_[k] * x2;
        j.row(2) = factor_ / root * (x1_[k] * x2 + x2_[k] * x1);
      }
    }
  }

  void Area(const Vec3& x1, const Vec3& x2, double* residuals, double** jacobians) const {
    const Vec3 cross = x1.cross(x2), normal = cross.normalized();
    residuals[0] = factor_ * (cross.norm() - 1);
    for (int k = 0; jacobians != nullptr && k < x1_.size(); ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Vec3>(jacobians[k], 3) =
            factor_ * (x1_[k] * x2.cross(normal) + x2_[k] * normal.cross(x1));
      }
    }
  }

  Eigen::VectorXd x1_, x2_;  // weights per dof
  Vec3 fixed_x1_, fixed_x2_;
  DistortionOf of_;
  double factor_;
};

}  // namespace

void AddResiduals(const DistortionTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  const std::vector<Sample> samples = MakeSamples(view);
  const double area = AreaSum(samples);
  for (const Sample& sample : samples) {
    std::vector<double*> blocks;
    for (const int dof : sample.element.dofs) {
      blocks.push_back(net.vertices[dof].data());
    }
    const double factor = term.length_mm * std::sqrt(term.weight * sample.area / area);
    problem.AddResidualBlock(new DistortionCost(sample, term.of, factor), nullptr, blocks);
  }
}

double TermCost(const DistortionTerm& term, const LevelView& view, const ControlNet& net) {
  const std::vector<Sample> samples = MakeSamples(view);
  double sum = 0;
  for (const Sample& sample : samples) {
    const TemplateAxes identity{.a1 = 1, .a2 = 0, .b2 = 1, .area = 1};
    const PatchMatrix vertices = sample.element.Vertices(net);
    const Strain strain =
        ComputeStrain(identity, Applied(sample.x1, vertices), Applied(sample.x2, vertices));
    sum += sample.area *
           (term.of == DistortionOf::kMetric ? strain.SquaredNorm() : strain.area * strain.area);
  }
  const double scale = term.weight * term.length_mm * term.length_mm;
  return samples.empty() ? 0 : scale * sum / AreaSum(samples);
}

}  // namespace semblance::fitting
