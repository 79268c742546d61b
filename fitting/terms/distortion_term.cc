// SPDX-License-Identifier: GPL-3.0-or-later
#include <ceres/cost_function.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "fitting/terms/strain.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

// One of the 2 x 2 Gauss points of each patch where the template has tangents.
struct Sample {
  SplineElement element;
  std::array<double, 16> x1{}, x2{};  // of the images of the template's axes, 1/mm
  double area = kNaN;                 // of the template, relative
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

std::vector<Sample> SamplesOf(const LevelView& view) {
  std::vector<Sample> samples;
  for (int e = 0; e < view.elements(); ++e) {
    AddSamples(view, view.Element(e), samples);
  }
  return samples;
}

// Weights of an element's vertices as weights of its dofs.
Eigen::VectorXd OverDofs(const Weights& weights, const SplineElement& element) {
  const Eigen::Map<const Eigen::Matrix<double, 16, 1>> local(weights.data());
  return element.IsIdentity() ? Eigen::VectorXd(local)
                              : Eigen::VectorXd(element.extraction.transpose() * local);
}

double AreaOf(const std::vector<Sample>& samples) {
  double sum = 0;
  for (const Sample& sample : samples) {
    sum += sample.area;
  }
  return sum;
}

// factor (e11, e22, sqrt(2) e12), or factor (area / template's - 1).
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

  Eigen::VectorXd x1_, x2_;  // by dof
  Vec3 fixed_x1_, fixed_x2_;
  DistortionOf of_;
  double factor_;
};

}  // namespace

void AddResiduals(const DistortionTerm& term, const LevelView& view, ControlNet& net,
                  ceres::Problem& problem) {
  const std::vector<Sample> samples = SamplesOf(view);
  const double area = AreaOf(samples);
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
  const std::vector<Sample> samples = SamplesOf(view);
  double sum = 0;
  for (const Sample& sample : samples) {
    const TemplateAxes identity{.a1 = 1, .a2 = 0, .b2 = 1, .area = 1};
    const PatchMatrix vertices = sample.element.Vertices(net);
    const Strain strain =
        StrainOf(identity, Applied(sample.x1, vertices), Applied(sample.x2, vertices));
    sum += sample.area *
           (term.of == DistortionOf::kMetric ? strain.SquaredNorm() : strain.area * strain.area);
  }
  const double scale = term.weight * term.length_mm * term.length_mm;
  return samples.empty() ? 0 : scale * sum / AreaOf(samples);
}

}  // namespace semblance
