// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/outlier_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace semblance {
namespace {

constexpr std::ptrdiff_t kBlock = 24;  // points that share a median; half as many more on each side
constexpr int kNearest = 8, kWindow = 20, kPasses = 4;
constexpr double kFar = 6, kAlike = 0.5;
// Standard deviation along one axis over the median of the distance, for normal errors along 1, 2
// and 3 axes.
constexpr std::array<double, 4> kSdOfMedian = {1, 1.4826, 0.8493, 0.6501};

class OutlierSearch {
 public:
  OutlierSearch(const NestedPoints& points, std::span<const std::uint32_t> indices,
                std::span<const NestedResidual> residuals, double least_sd_mm)
      : points_(points), indices_(indices), residuals_(residuals), least_sd_mm_(least_sd_mm) {}

  // Of each of the indices.
  std::vector<char> Pass(const std::vector<char>& before) {
    before_ = &before;
    std::vector<char> found(indices_.size(), 0);
    const std::ptrdiff_t count = std::ssize(indices_);
    for (std::ptrdiff_t begin = 0; begin < count; begin += kBlock) {
      const std::ptrdiff_t end = std::min(begin + kBlock, count);
      if (IsCalm(std::max<std::ptrdiff_t>(begin - kBlock / 2, 0),
                 std::min(end + kBlock / 2, count))) {
        continue;
      }
      Look(std::max<std::ptrdiff_t>(begin - kBlock / 2, 0), std::min(end + kBlock / 2, count));
      for (std::ptrdiff_t k = begin; k < end; ++k) {
        found[k] = Off(k) > far_ && !HasCompany(k) ? 1 : 0;
      }
    }
    return found;
  }

 private:
  static double Median(std::vector<double>& values) {
    const auto middle = values.begin() + std::ssize(values) / 2;
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }

  // All values, if too few have a vote.
  template <class Value>
  double MedianOf(std::ptrdiff_t begin, std::ptrdiff_t end, const Value& value) {
    values_.clear();
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      if ((*before_)[k] == 0) {
        values_.push_back(value(k));
      }
    }
    if (std::ssize(values_) < kBlock / 3) {
      values_.clear();
      for (std::ptrdiff_t k = begin; k < end; ++k) {
        values_.push_back(value(k));
      }
    }
    return Median(values_);
  }

  // Whether none can be far: a median is no farther from the mean than the standard deviation.
  bool IsCalm(std::ptrdiff_t begin, std::ptrdiff_t end) const {
    std::array<double, 3> sum{}, squares{};
    double largest = 0;
    char voteless = 0;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      const std::array<double, 3>& e = residuals_[k].along;
      voteless |= (*before_)[k];
      for (int c = 0; c < 3; ++c) {
        sum[c] += e[c];
        squares[c] += e[c] * e[c];
      }
      largest = std::max(largest, residuals_[k].Square());
    }
    const auto count = static_cast<double>(end - begin);
    double middle = 0;
    for (int c = 0; c < 3; ++c) {
      const double mean = sum[c] / count,
                   reach =
                       std::abs(mean) + std::sqrt(std::max(squares[c] / count - mean * mean, 0.0));
      middle += reach * reach;
    }
    return voteless == 0 && std::sqrt(largest) + std::sqrt(middle) < kFar * least_sd_mm_;
  }

  void Look(std::ptrdiff_t begin, std::ptrdiff_t end) {
    for (int c = 0; c < points_.channels; ++c) {
      middle_[c] = MedianOf(begin, end, [&](std::ptrdiff_t k) { return residuals_[k].along[c]; });
    }
    const double sd = kSdOfMedian[points_.channels] *
                      MedianOf(begin, end, [&](std::ptrdiff_t k) { return Off(k); });
    far_ = kFar * std::max(sd, least_sd_mm_);
  }

  double Off(std::ptrdiff_t k) const {
    double square = 0;
    for (int c = 0; c < points_.channels; ++c) {
      const double off = residuals_[k].along[c] - middle_[c];
      square += off * off;
    }
    return std::sqrt(square);
  }

  // Whether b is off as a is.
  bool Alike(std::ptrdiff_t a, std::ptrdiff_t b) const {
    double apart = 0;
    for (int c = 0; c < points_.channels; ++c) {
      const double d = residuals_[a].along[c] - residuals_[b].along[c];
      apart += d * d;
    }
    return std::sqrt(apart) < kAlike * Off(a);
  }

  // Among the points that stand next to it along the curve.
  bool HasCompany(std::ptrdiff_t k) {
    near_.clear();
    const std::ptrdiff_t end = std::min(k + kWindow + 1, std::ssize(indices_));
    for (std::ptrdiff_t q = std::max<std::ptrdiff_t>(k - kWindow, 0); q < end; ++q) {
      if (q != k) {
        const double dx = points_.x[indices_[q]] - points_.x[indices_[k]],
                     dy = points_.y[indices_[q]] - points_.y[indices_[k]];
        near_.emplace_back(dx * dx + dy * dy, q);
      }
    }
    const std::ptrdiff_t nearest = std::min<std::ptrdiff_t>(kNearest, std::ssize(near_));
    std::partial_sort(near_.begin(), near_.begin() + nearest, near_.end());
    const auto alike = std::count_if(near_.begin(), near_.begin() + nearest, [&](const auto& n) {
      return (*before_)[n.second] == 0 && Alike(k, n.second);
    });
    return 2 * alike >= kNearest;
  }

  const NestedPoints& points_;
  std::span<const std::uint32_t> indices_;
  std::span<const NestedResidual> residuals_;
  double least_sd_mm_;
  const std::vector<char>* before_ = nullptr;
  std::array<double, 3> middle_{};
  double far_ = 0;
  std::vector<double> values_;
  std::vector<std::pair<double, std::ptrdiff_t>> near_;
};

}  // namespace

int FindOutliers(const NestedPoints& points, std::span<const std::uint32_t> indices,
                 std::span<const NestedResidual> residuals, double least_sd_mm,
                 std::vector<char>& outlier) {
  OutlierSearch search(points, indices, residuals, least_sd_mm);
  std::vector<char> found(indices.size());
  for (std::size_t k = 0; k < indices.size(); ++k) {
    found[k] = outlier[indices[k]];
  }
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<char> next = search.Pass(found);
    if (next == found) {
      break;
    }
    found.swap(next);
  }
  for (std::size_t k = 0; k < indices.size(); ++k) {
    outlier[indices[k]] = found[k];
  }
  return static_cast<int>(std::count(found.begin(), found.end(), 1));
}

}  // namespace semblance
