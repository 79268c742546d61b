// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/kriging.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace semblance {
namespace {

constexpr std::size_t kFitSamples = 200;  // enough for two numbers; the cost grows by the cube
constexpr double kFirstJitter = 1e-10;    // of the variance, on the diagonal
constexpr double kFlatDepths_mm = 1e-3;   // depths that spread less than this are one depth

// 1 at distance 0. As usual, the Matern family is scaled so that the length means alike in all.
double Correlation(Covariance covariance, double distance_mm, double length_mm) {
  const double r = distance_mm / length_mm;
  switch (covariance) {
    case Covariance::kMatern12:
      return std::exp(-r);
    case Covariance::kMatern32: {
      const double s = std::numbers::sqrt3 * r;
      return (1 + s) * std::exp(-s);
    }
    case Covariance::kMatern52: {
      const double s = std::sqrt(5.0) * r;
      return (1 + s + s * s / 3) * std::exp(-s);
    }
    case Covariance::kSquaredExponential:
      break;
  }
  return std::exp(-r * r / 2);
}

struct Hyper {
  double length_mm = 1;
  double signal_mm = 1;
};

// The dowels' covariance V = signal^2 K + nugget, factored, and the mean that belongs to it.
class Process {
 public:
  Process(const Kriging& options, const std::vector<DepthSample>& samples, const Hyper& hyper)
      : covariance_(options.covariance), hyper_(hyper) {
    const auto n = static_cast<Eigen::Index>(samples.size());
    Eigen::VectorXd depths(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      bases_.push_back(samples[i].base);
      depths[i] = samples[i].depth_mm;
    }
    Factor(samples, options.nugget_share);
    inverse_ones_ = factor_.solve(Eigen::VectorXd::Ones(n));
    ones_ = inverse_ones_.sum();
    mean_mm_ = inverse_ones_.dot(depths) / ones_;
    const Eigen::VectorXd residual = depths.array() - mean_mm_;
    weights_ = factor_.solve(residual);
    misfit_ = residual.dot(weights_);
  }

  double Mean() const { return mean_mm_; }

  // log |V| + log 1'V^-1 1 + r'V^-1 r: minus twice the restricted log likelihood, but for a
  // constant.
  double Deviance() const {
    double log_root = 0;
    for (Eigen::Index i = 0; i < weights_.size(); ++i) {
      log_root += std::log(factor_.matrixLLT()(i, i));
    }
    return 2 * log_root + std::log(ones_) + misfit_;
  }

  // Before the first DepthAt with an sd.
  void PrepareSd() {
    const auto n = weights_.size();
    inverse_root_ = factor_.matrixL().solve(Eigen::MatrixXd::Identity(n, n));
  }

  DepthValue DepthAt(const Vec3& p) const {
    const Eigen::VectorXd with = WithDowels(p);
    return {mean_mm_ + with.dot(weights_), inverse_root_.size() > 0 ? Sd(with) : kNaN};
  }

  DepthPosterior Posterior(std::span<const Vec3> places) const {
    const auto n = static_cast<Eigen::Index>(places.size());
    Eigen::MatrixXd with(weights_.size(), n), all(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      with.col(i) = WithDowels(places[i]);
      for (Eigen::Index j = 0; j <= i; ++j) {
        all(i, j) = all(j, i) = CovarianceAt((places[i] - places[j]).norm());
      }
    }
    const Eigen::MatrixXd known = factor_.matrixL().solve(with);
    const Eigen::VectorXd of_mean = 1 - (with.transpose() * inverse_ones_).array();
    return {(with.transpose() * weights_).array() + mean_mm_,
            all - known.transpose() * known + of_mean * of_mean.transpose() / ones_};
  }

 private:
  Eigen::VectorXd WithDowels(const Vec3& p) const {
    Eigen::VectorXd with(weights_.size());
    for (Eigen::Index i = 0; i < with.size(); ++i) {
      with[i] = CovarianceAt((bases_[i] - p).norm());
    }
    return with;
  }

  double CovarianceAt(double distance_mm) const {  // mm^2
    return hyper_.signal_mm * hyper_.signal_mm *
           Correlation(covariance_, distance_mm, hyper_.length_mm);
  }

  double Sd(const Eigen::VectorXd& with) const {
    const double of_mean = 1 - inverse_ones_.dot(with);
    const double variance = hyper_.signal_mm * hyper_.signal_mm -
                            (inverse_root_ * with).squaredNorm() + of_mean * of_mean / ones_;
    return std::sqrt(std::max(variance, 0.0));
  }

  void Factor(const std::vector<DepthSample>& samples, double nugget_share) {
    const auto n = static_cast<Eigen::Index>(samples.size());
    Eigen::MatrixXd matrix(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        matrix(i, j) = CovarianceAt((bases_[i] - bases_[j]).norm());
      }
      const double nugget = nugget_share * samples[i].sd_mm;
      matrix(i, i) += std::isfinite(nugget) ? nugget * nugget : 0;
    }
    // Smooth covariances of near dowels are singular by rounding.
    const double variance = hyper_.signal_mm * hyper_.signal_mm;
    for (double jitter = kFirstJitter; jitter < 1; jitter *= 10) {
      factor_.compute(matrix + jitter * variance * Eigen::MatrixXd::Identity(n, n));
      if (factor_.info() == Eigen::Success) {
        return;
      }
    }
  }

  Covariance covariance_;
  Hyper hyper_;
  std::vector<Vec3> bases_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd inverse_ones_, weights_;
  Eigen::MatrixXd inverse_root_;  // empty without PrepareSd
  double ones_ = 0, mean_mm_ = 0, misfit_ = 0;
};

// `count` samples, each the furthest from those before it, beginning with the first.
std::vector<DepthSample> FarApart(const std::vector<DepthSample>& samples, std::size_t count) {
  if (samples.size() <= count) {
    return samples;
  }
  std::vector<DepthSample> chosen;
  std::vector<double> distance(samples.size(), std::numeric_limits<double>::infinity());
  std::size_t next = 0;
  while (chosen.size() < count) {
    chosen.push_back(samples[next]);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      distance[i] = std::min(distance[i], (samples[i].base - samples[next].base).norm());
    }
    next = std::ranges::max_element(distance) - distance.begin();
  }
  return chosen;
}

double DepthSpread(const std::vector<DepthSample>& samples) {
  double sum = 0, squares = 0;
  for (const DepthSample& sample : samples) {
    sum += sample.depth_mm;
  }
  const double mean = sum / static_cast<double>(samples.size());
  for (const DepthSample& sample : samples) {
    squares += (sample.depth_mm - mean) * (sample.depth_mm - mean);
  }
  return std::max(std::sqrt(squares / static_cast<double>(samples.size())), kFlatDepths_mm);
}

// The two logarithms that are searched, each within bounds; equal bounds hold it fixed.
struct Search {
  Vec2 low, high, prior;

  Search(const Kriging& options, const std::vector<DepthSample>& samples) {
    const double spread = DepthSpread(samples);
    prior = {std::log(options.length_prior_mm), 0};
    low = {prior[0] - 3, std::log(spread / 30)};
    high = {prior[0] + 3, std::log(spread * 10)};
    if (options.length_mm) {
      low[0] = high[0] = std::log(*options.length_mm);
    }
    if (options.signal_mm) {
      low[1] = high[1] = std::log(*options.signal_mm);
    }
  }
  bool Contains(const Vec2& x) const {
    return (x.array() >= low.array()).all() && (x.array() <= high.array()).all();
  }
};

Hyper HyperOf(const Vec2& logs) { return {std::exp(logs[0]), std::exp(logs[1])}; }

template <class Cost>
Vec2 BestOfGrid(const Search& search, const Cost& cost) {
  constexpr int kSteps = 8;
  Vec2 best = search.low;
  double least = std::numeric_limits<double>::infinity();
  const Vec2 range = search.high - search.low;
  for (int i = 0; i <= (range[0] > 0 ? kSteps : 0); ++i) {
    for (int j = 0; j <= (range[1] > 0 ? kSteps : 0); ++j) {
      const Vec2 x = search.low + Vec2(range[0] * i / kSteps, range[1] * j / kSteps);
      const double value = cost(x);
      if (value < least) {
        least = value;
        best = x;
      }
    }
  }
  return best;
}

// Halves its steps wherever none of the four neighbours is better; to 1e-3 of the logarithms.
template <class Cost>
Vec2 CompassSearch(const Search& search, const Cost& cost, Vec2 best) {
  double least = cost(best);
  for (double step = 0.4; step > 1e-3;) {
    bool better = false;
    for (const Vec2& way : {Vec2(1, 0), Vec2(-1, 0), Vec2(0, 1), Vec2(0, -1)}) {
      const Vec2 x = best + step * way;
      const double value = search.Contains(x) ? cost(x) : least;
      if (value < least) {
        least = value;
        best = x;
        better = true;
      }
    }
    step = better ? step : step / 2;
  }
  return best;
}

Hyper FitHyper(const Kriging& options, const std::vector<DepthSample>& all, const RunContext& run) {
  if (options.length_mm && options.signal_mm) {
    return {*options.length_mm, *options.signal_mm};
  }
  const std::vector<DepthSample> samples = FarApart(all, kFitSamples);
  const Search search(options, samples);
  const auto cost = [&](const Vec2& logs) {
    run.ThrowIfStopped();
    const double away = (logs[0] - search.prior[0]) / options.length_prior_spread;
    return Process(options, samples, HyperOf(logs)).Deviance() + away * away;
  };
  return HyperOf(CompassSearch(search, cost, BestOfGrid(search, cost)));
}

}  // namespace

KrigingModel FitKriging(const Kriging& options, const DepthInput& input, const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const Hyper hyper = FitHyper(options, samples, run);
  return {hyper.length_mm, hyper.signal_mm, Process(options, samples, hyper).Mean()};
}

DepthPosterior KrigingPosterior(const Kriging& options, const DepthInput& input,
                                std::span<const Vec3> places, const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  return Process(options, samples, FitHyper(options, samples, run)).Posterior(places);
}

DepthField InterpolateDepth(const Kriging& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, options.clamp);
  Process process(options, samples, FitHyper(options, samples, run));
  if (options.state_sd) {
    process.PrepareSd();
  }
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const DepthValue value = process.DepthAt(input.skull.points[i]);
    return DepthValue{limits(value.mm), value.sd_mm};
  });
}

}  // namespace semblance
