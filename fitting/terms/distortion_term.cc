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
  std::array<int, 16> vertices{};
  std::array<double, 16> x1{}, x2{};  // of the images of the template's axes, 1/mm
  double area = kNaN;                 // of the template, relative
};

std::vector<Sample> SamplesOf(const LevelView& view) {
  const PatchGrid& grid = view.grid;
  std::vector<Sample> samples;
  for (int k = 0; k < 4 * grid.patches_u * grid.patches_v; ++k) {
    const Vec2 uv = GaussPoint(k, grid.patches_u, grid.patches_v);
    const Stencil du = grid.StencilAt(uv, {1, 0}), dv = grid.StencilAt(uv, {0, 1});
    const auto axes = TemplateAxes::At(du.Apply(view.rest), dv.Apply(view.rest));
    if (!axes) {
      continue;
    }
    Sample sample{.vertices = du.index, .area = axes->area};
    for (int v = 0; v < 16; ++v) {
      sample.x1[v] = axes->a1 * du.weight[v];
      sample.x2[v] = axes->a2 * du.weight[v] + axes->b2 * dv.weight[v];
    }
    samples.push_back(sample);
  }
  return samples;
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
      : sample_(sample), of_(of), factor_(factor) {
    mutable_parameter_block_sizes()->assign(16, 3);
    set_num_residuals(of == DistortionOf::kMetric ? 3 : 1);
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Vec3 x1 = Vec3::Zero(), x2 = Vec3::Zero();
    for (int k = 0; k < 16; ++k) {
      x1 += sample_.x1[k] * Eigen::Map<const Vec3>(parameters[k]);
      x2 += sample_.x2[k] * Eigen::Map<const Vec3>(parameters[k]);
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
    for (int k = 0; jacobians != nullptr && k < 16; ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> j(jacobians[k]);
        j.row(0) = factor_ * sample_.x1[k] * x1;
        j.row(1) = factor_ * sample_.x2[k] * x2;
        j.row(2) = factor_ / root * (sample_.x1[k] * x2 + sample_.x2[k] * x1);
      }
    }
  }

  void Area(const Vec3& x1, const Vec3& x2, double* residuals, double** jacobians) const {
    const Vec3 cross = x1.cross(x2), normal = cross.normalized();
    residuals[0] = factor_ * (cross.norm() - 1);
    for (int k = 0; jacobians != nullptr && k < 16; ++k) {
      if (jacobians[k] != nullptr) {
        Eigen::Map<Vec3>(jacobians[k], 3) =
            factor_ * (sample_.x1[k] * x2.cross(normal) + sample_.x2[k] * normal.cross(x1));
      }
    }
  }

  Sample sample_;
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
    for (const int vertex : sample.vertices) {
      blocks.push_back(net.vertices[vertex].data());
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
    Stencil x1{.index = sample.vertices, .weight = sample.x1},
        x2{.index = sample.vertices, .weight = sample.x2};
    const Strain strain = StrainOf(identity, x1.Apply(net), x2.Apply(net));
    sum += sample.area *
           (term.of == DistortionOf::kMetric ? strain.SquaredNorm() : strain.area * strain.area);
  }
  const double scale = term.weight * term.length_mm * term.length_mm;
  return samples.empty() ? 0 : scale * sum / AreaOf(samples);
}

}  // namespace semblance
