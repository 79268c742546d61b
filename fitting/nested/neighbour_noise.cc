// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/neighbour_noise.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

// Finds the nearest points to a point among those before and after it along the curve.
class Neighbourhood {
 public:
  Neighbourhood(const NestedPoints& points, std::span<const std::uint32_t> indices)
      : points_(points), indices_(indices) {}

  // The point itself and its `count` nearest points, sorted by distance.
  std::vector<std::uint32_t> Of(std::size_t n, std::size_t count) const {
    const std::size_t window = 3 * count, begin = n > window ? n - window : 0,
                      end = std::min(n + window + 1, indices_.size());
    std::vector<std::pair<double, std::uint32_t>> near;
    for (std::size_t k = begin; k < end; ++k) {
      const double dx = points_.X(indices_[k]) - points_.X(indices_[n]),
                   dy = points_.Y(indices_[k]) - points_.Y(indices_[n]);
      near.emplace_back(dx * dx + dy * dy, indices_[k]);
    }
    const std::size_t taken = std::min(count + 1, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(taken), near.end());
    std::vector<std::uint32_t> found;
    for (std::size_t k = 0; k < taken; ++k) {
      found.push_back(near[k].second);
    }
    return found;
  }

 private:
  const NestedPoints& points_;
  std::span<const std::uint32_t> indices_;
};

enum class Weighing { kByWeight, kEqual };

// The squared residual of a polynomial fit per degree of freedom and channel.
double ResidualVariance(const NestedPoints& points, const std::vector<std::uint32_t>& near,
                        int terms, Weighing weighing) {
  const auto count = static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd rows(count, terms), values(count, points.channels);
  double scale = 1e-300;
  for (const std::uint32_t k : near) {
    scale = std::max({scale, std::abs(points.X(k) - points.X(near[0])),
                      std::abs(points.Y(k) - points.Y(near[0]))});
  }
  for (Eigen::Index r = 0; r < count; ++r) {
    const std::uint32_t k = near[r];
    const double x = (points.X(k) - points.X(near[0])) / scale,
                 y = (points.Y(k) - points.Y(near[0])) / scale;
    const std::array<double, 6> row = {1, x, y, x * x, x * y, y * y};
    const double scale_of_k = weighing == Weighing::kByWeight ? points.Scale(k) : 1;
    rows.row(r) = scale_of_k * Eigen::Map<const Eigen::RowVectorXd>(row.data(), terms);
    for (int c = 0; c < points.channels; ++c) {
      values(r, c) = scale_of_k * points.value[k][c];
    }
  }
  const Eigen::MatrixXd left = values - rows * rows.colPivHouseholderQr().solve(values);
  return left.squaredNorm() / static_cast<double>((count - terms) * points.channels);
}

double Noise(const NestedPoints& points, std::span<const std::uint32_t> indices,
             NeighbourModel model, Weighing weighing) {
  constexpr std::size_t kSamples = 1000;  // the median's error is then about 3 %; bounds the time
  const std::size_t count = model == NeighbourModel::kPlaneOf8 ? 8 : 20;
  const int terms = model == NeighbourModel::kPlaneOf8 ? 3 : 6;
  if (indices.size() < 2 * count) {
    return kNaN;
  }
  const Neighbourhood neighbourhood(points, indices);
  std::vector<double> squares;
  for (std::size_t n = 0; n < indices.size();
       n += std::max<std::size_t>(indices.size() / kSamples, 1)) {
    squares.push_back(ResidualVariance(points, neighbourhood.Of(n, count), terms, weighing));
  }
  // The median of a chi-squared variable divided by its mean (Wilson & Hilferty 1931).
  const double freedom = static_cast<double>(count + 1 - terms) * points.channels;
  return std::sqrt(UpperMedian(squares) / std::pow(1 - 2 / (9 * freedom), 3));
}

double WeightQuantile(const NestedPoints& points, std::span<const std::uint32_t> indices,
                      double share) {
  std::vector<double> weights;
  for (const std::uint32_t k : indices) {
    weights.push_back(points.Weight(k));
  }
  return weights.empty() ? kNaN : Quantile(weights, share);
}

}  // namespace

double NeighbourNoise(const NestedPoints& points, std::span<const std::uint32_t> indices,
                      NeighbourModel model) {
  return Noise(points, indices, model, Weighing::kByWeight);
}

NoiseByWeight CompareNoiseByWeight(const NestedPoints& points,
                                   std::span<const std::uint32_t> indices) {
  constexpr double kOuter = 0.05;  // a few extreme weights do not move the middle
  const double middle = std::sqrt(WeightQuantile(points, indices, kOuter) *
                                  WeightQuantile(points, indices, 1 - kOuter));
  std::vector<std::uint32_t> light, heavy;  // in the order along the curve
  for (const std::uint32_t k : indices) {
    (points.Weight(k) < middle ? light : heavy).push_back(k);
  }
  const auto noise = [&points](const std::vector<std::uint32_t>& half) {
    return Noise(points, half, NeighbourModel::kPlaneOf8, Weighing::kEqual);
  };
  return {.light_mm = noise(light),
          .heavy_mm = noise(heavy),
          .light_weight = WeightQuantile(points, light, 0.5),
          .heavy_weight = WeightQuantile(points, heavy, 0.5)};
}

void PairCorrelation::Add(const NestedResidual& a, const NestedResidual& b) {
  for (int c = 0; c < 3; ++c) {
    together_ += a.along[c] * b.along[c];
  }
  squares_ += (a.Square() + b.Square()) / 2;
  ++count_;
}

PairCorrelation ClosestCorrelation(const NestedPoints& points,
                                   std::span<const std::uint32_t> indices,
                                   std::span<const NestedResidual> residuals) {
  // One pair in ten: closer pairs share finer detail, more pairs have a smaller standard error.
  constexpr std::ptrdiff_t kOneIn = 10;
  std::vector<double> apart;
  for (std::size_t n = 0; n + 1 < indices.size(); ++n) {
    const double dx = points.X(indices[n]) - points.X(indices[n + 1]),
                 dy = points.Y(indices[n]) - points.Y(indices[n + 1]);
    apart.push_back(dx * dx + dy * dy);
  }
  if (apart.empty()) {
    return {};
  }
  std::vector<double> sorted = apart;
  const auto tenth = sorted.begin() + std::ssize(sorted) / kOneIn;
  std::nth_element(sorted.begin(), tenth, sorted.end());
  PairCorrelation pairs;
  for (std::size_t n = 0; n + 1 < indices.size(); ++n) {
    if (apart[n] <= *tenth) {
      pairs.Add(residuals[n], residuals[n + 1]);
    }
  }
  return pairs;
}

}  // namespace semblance::fitting
