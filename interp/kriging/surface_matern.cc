// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging/surface_matern.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "interp/kriging/bounded_minimum.h"
#include "interp/kriging/gaussian_regression.h"
#include "interp/kriging/kriging_process.h"
#include "interp/on_surface/bone_geometry.h"
#include "interp/on_surface/coarse_surface.h"
#include "interp/on_surface/matern_field.h"
#include "surfaces/base/farthest_first.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

constexpr Eigen::Index kMaternSamples = 60;  // enough to determine three numbers; the number of
                                             // modes grows with them

// The surface of the process, and the dowels on it.
struct SurfaceScene {
  CoarseSurface surface;
  MaternDomain domain;
  std::vector<Vec3> bases;
  std::vector<CornerWeights> at;  // per dowel
  SurfaceMaternData data;
};

// Locates each dowel on the side of the bone that is closest to its base.
std::vector<CornerWeights> LocateSamples(const TriMesh& skull, const CoarseSurface& surface,
                                         const std::vector<Vec3>& bases) {
  const MeshQuery query(skull);
  std::vector<CornerWeights> located;
  for (const Vec3& base : bases) {
    const MeshPoint on = query.Closest(base);
    located.push_back(surface.Locate(on.position, NearestCorner(skull, on)));
  }
  return located;
}

// The relative length per vertex; 1 where the bone is smooth.
Eigen::VectorXd LengthShares(const TriMesh& bone, double half_at_relief_mm) {
  constexpr std::array kScale_mm = {40.0};
  const Eigen::ArrayXd relief_mm = BoneRelief(bone, kScale_mm).row(0).transpose().array().abs();
  return (1 + relief_mm / half_at_relief_mm).inverse();
}

MaternDomain MakeDomain(const SurfaceMatern& options, const TriMesh& bone) {
  MaternDomain domain = {bone.points, BuildLaplacian(bone)};
  return options.half_at_relief_mm
             ? WithLengths(std::move(domain), LengthShares(bone, *options.half_at_relief_mm))
             : domain;
}

SurfaceScene MakeScene(const SurfaceMatern& options, const DepthInput& input,
                       const std::vector<DepthSample>& samples, const MeanRegressors& mean,
                       const RunContext& run) {
  const auto n = static_cast<Eigen::Index>(samples.size());
  SurfaceScene scene{CoarseSurface(input.skull, options.edge_mm, run), {}, {}, {}, {}};
  scene.domain = MakeDomain(options, scene.surface.mesh());
  scene.data = {Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::MatrixXd()};
  for (const DepthSample& sample : samples) {
    const auto i = static_cast<Eigen::Index>(scene.bases.size());
    scene.data.depth_mm[i] = sample.depth_mm;
    scene.data.nugget_mm2[i] = Nugget_mm2(options.nugget_share, sample.sd_mm);
    scene.bases.push_back(sample.base);
  }
  scene.data.regressors = mean.At(scene.bases, run).transpose();
  scene.at = LocateSamples(input.skull, scene.surface, scene.bases);
  return scene;
}

// The weights of vertices; one column per dowel of `some`.
Eigen::MatrixXd DowelWeights(const SurfaceScene& scene, const std::vector<std::size_t>& some) {
  Eigen::MatrixXd weights =
      Eigen::MatrixXd::Zero(std::ssize(scene.domain.points), std::ssize(some));
  for (std::size_t k = 0; k < some.size(); ++k) {
    const CornerWeights& at = scene.at[some[k]];
    for (int c = 0; c < 3; ++c) {
      weights(at.corners[c], static_cast<Eigen::Index>(k)) += at.weights[c];
    }
  }
  return weights;
}

SurfaceMaternHyper HyperFor(const SurfaceMatern& options, const SurfaceScene& scene,
                            const RunContext& run) {
  if (options.length_mm && options.signal_mm && !options.fit_nugget) {
    return {*options.length_mm, *options.signal_mm, 0};
  }
  const std::vector<std::size_t> some = FarthestFirst(scene.bases, 0, kMaternSamples);
  const ReducedMatern correlations(scene.domain, DowelWeights(scene, some), SearchPoles(options),
                                   run);
  return FitHyper(options,
                  {scene.data.depth_mm(some), scene.data.nugget_mm2(some),
                   scene.data.regressors(some, Eigen::all)},
                  correlations, run);
}

// The process with known length, signal and nugget.
class SurfaceProcess {
 public:
  SurfaceProcess(const SurfaceMatern& options, const SurfaceScene& scene,
                 const SurfaceMaternHyper& hyper, const RunContext& run)
      : with_sd_(options.state_sd && KnowsSignal(options.signal_mm, scene.data.regressors)),
        signal_mm_(hyper.signal_mm),
        regression_(Regression(options, scene, hyper, run)) {
    if (with_sd_) {
      regression_.PrepareVariance();
    }
  }

  const Eigen::VectorXd& coefficients() const { return regression_.coefficients(); }

  DepthValue ValueAt(const CornerWeights& at, const Eigen::VectorXd& regressors) const {
    const Eigen::VectorXd with = CovariancesAt(at);
    const double depth_mm =
        regressors.dot(regression_.coefficients()) + with.dot(regression_.weights());
    if (!with_sd_) {
      return {depth_mm, kNaN};
    }
    const double variance = regression_.Variance(with, regressors, signal_mm_ * signal_mm_);
    return {depth_mm, std::sqrt(std::max(variance, 0.0))};
  }

 private:
  // Also fills with_dowels_ and local_.
  GaussianRegression Regression(const SurfaceMatern& options, const SurfaceScene& scene,
                                const SurfaceMaternHyper& hyper, const RunContext& run) {
    const MaternField field(scene.domain, options.alpha,
                            MaternKappa(options.alpha, hyper.length_mm));
    const auto n = static_cast<Eigen::Index>(scene.at.size());
    std::vector<std::size_t> all(scene.at.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    local_ = field.LocalCovariances();
    run.ThrowIfStopped();
    with_dowels_ = field.Covariances(DowelWeights(scene, all), run).transpose();
    for (Eigen::Index k = 0; k < n; ++k) {
      with_dowels_.row(k) *= signal_mm_ / std::sqrt(VarianceAt(scene.at[k]));
    }
    Eigen::MatrixXd covariance(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      covariance.col(k) = CovariancesAt(scene.at[k]);
    }
    covariance = (covariance + covariance.transpose()).eval() / 2;
    covariance.diagonal() +=
        (scene.data.nugget_mm2.array() + hyper.nugget_mm * hyper.nugget_mm).matrix();
    return {covariance, signal_mm_ * signal_mm_, scene.data.depth_mm, scene.data.regressors};
  }

  // The variance of the field before its division by the standard deviation.
  double VarianceAt(const CornerWeights& at) const {
    double variance = 0;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        const double weight = at.weights[a] * at.weights[b];
        variance += weight > 0 ? weight * local_.coeff(at.corners[a], at.corners[b]) : 0;
      }
    }
    return variance;
  }

  // The covariances with each dowel.
  Eigen::VectorXd CovariancesAt(const CornerWeights& at) const {
    Eigen::VectorXd with = at.weights[0] * with_dowels_.col(at.corners[0]);
    with += at.weights[1] * with_dowels_.col(at.corners[1]);
    with += at.weights[2] * with_dowels_.col(at.corners[2]);
    return with * (signal_mm_ / std::sqrt(VarianceAt(at)));
  }

  bool with_sd_;
  double signal_mm_;
  Eigen::SparseMatrix<double> local_;  // covariances along edges before the division
  Eigen::MatrixXd with_dowels_;        // n x m; divided by the dowels' standard deviations only
  GaussianRegression regression_;
};

constexpr double kLogLengthRange = 2.5;  // range of the length's logarithm on each side of the
                                         // prior's median
constexpr int kPoles = 8;

double FittedNugget(const SurfaceMatern& options, const Eigen::VectorXd& logs) {
  return options.fit_nugget ? std::exp(logs[2]) : 0;
}

SurfaceMaternHyper MakeHyper(const SurfaceMatern& options, const Eigen::VectorXd& logs) {
  return {std::exp(logs[0]), std::exp(logs[1]), FittedNugget(options, logs)};
}

// The ranges of the three logarithms.
SearchRange SearchBounds(const SurfaceMatern& options, const SurfaceMaternData& data) {
  const double prior = std::log(options.length_prior_mm);
  const double spread = std::log(DepthSpread(data.depth_mm));
  SearchRange bounds{
      Vec3(prior - kLogLengthRange, spread - std::log(30.0), spread - std::log(100.0)),
      Vec3(prior + kLogLengthRange, spread + std::log(10.0), spread)};
  if (options.length_mm) {
    bounds.low[0] = bounds.high[0] = std::log(*options.length_mm);
  }
  if (options.signal_mm) {
    bounds.low[1] = bounds.high[1] = std::log(*options.signal_mm);
  }
  if (!options.fit_nugget) {
    bounds.low[2] = bounds.high[2];
  }
  return bounds;
}

}  // namespace

DepthField InterpolateDepth(const SurfaceMatern& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  CheckSurface(SurfaceMatern::kName, input.skull);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, options.clamp);
  const MeanRegressors mean(options.mean, SurfaceMatern::kName, input, run);
  const SurfaceScene scene = MakeScene(options, input, samples, mean, run);
  const Eigen::MatrixXd regressors = mean.AtVertices(run);
  const SurfaceMaternHyper hyper = HyperFor(options, scene, run);
  const SurfaceProcess process(options, scene, hyper, run);
  DepthField field =
      AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
        const CornerWeights at = scene.surface.Locate(input.skull.points[i], static_cast<int>(i));
        const DepthValue value = process.ValueAt(at, regressors.col(static_cast<Eigen::Index>(i)));
        return DepthValue{limits(value.mm), value.sd_mm};
      });
  field.process = {hyper.length_mm, hyper.signal_mm, hyper.nugget_mm,
                   (scene.data.regressors * process.coefficients()).mean(), hyper.at_end};
  return field;
}

std::vector<double> SearchPoles(const SurfaceMatern& options) {
  const auto pole = [&](double length_mm) {
    const double kappa = MaternKappa(options.alpha, length_mm);
    return kappa * kappa;
  };
  if (options.length_mm) {
    return {pole(*options.length_mm)};
  }
  std::vector<double> poles;
  for (int k = 0; k < kPoles; ++k) {
    const double log = kLogLengthRange * (2.0 * k / (kPoles - 1) - 1);
    poles.push_back(pole(options.length_prior_mm * std::exp(log)));
  }
  return poles;
}

double SurfaceMaternCost(const SurfaceMatern& options, const SurfaceMaternData& data,
                         const ReducedMatern& correlations, const Eigen::VectorXd& logs,
                         Eigen::VectorXd* gradient) {
  const SurfaceMaternHyper hyper = MakeHyper(options, logs);
  const double variance = hyper.signal_mm * hyper.signal_mm;
  const double nugget = hyper.nugget_mm * hyper.nugget_mm;
  const MaternCorrelations r = correlations.At(options.alpha, hyper.length_mm);
  Eigen::MatrixXd covariance = variance * r.value;
  covariance.diagonal() += (data.nugget_mm2.array() + nugget).matrix();
  const GaussianRegression regression(covariance, variance, data.depth_mm, data.regressors);
  const double away = (logs[0] - std::log(options.length_prior_mm)) / options.length_prior_spread;
  if (gradient != nullptr) {
    const Eigen::Index n = data.depth_mm.size();
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
    *gradient =
        Vec3(regression.DevianceAlong(variance * r.by_log_length) +
                 2 * away / options.length_prior_spread,
             regression.DevianceAlong(2 * variance * r.value + 2 * regression.added() * one),
             regression.DevianceAlong(2 * nugget * one));
  }
  return regression.Deviance() + away * away;
}

SurfaceMaternHyper FitHyper(const SurfaceMatern& options, const SurfaceMaternData& data,
                            const ReducedMatern& correlations, const RunContext& run) {
  constexpr std::array<std::string_view, 2> kNames = {"length", "signal"};
  const auto cost = [&](const Eigen::VectorXd& logs, Eigen::VectorXd* gradient) {
    return SurfaceMaternCost(options, data, correlations, logs, gradient);
  };
  const auto misfit_mm2 = [&](double length_mm) {
    return GaussianRegression(correlations.At(options.alpha, length_mm).value, 1, data.depth_mm,
                              data.regressors)
        .Misfit();
  };
  SearchRange bounds = SearchBounds(options, data);
  const Eigen::VectorXd logs = FindLogs(bounds, cost, misfit_mm2, run);
  SurfaceMaternHyper hyper = MakeHyper(options, logs);
  // A nugget at its lower bound means no nugget and is not reported.
  hyper.at_end = DescribeRangeEnds(kNames, bounds, cost, logs);
  return hyper;
}

}  // namespace semblance::interp
