// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/outlier_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

// The constants were chosen on the point sets of docs/explanation/fit.md, "How good it is".

// Points that share a median; half as many more on each side enter it. Larger blocks give steadier
// medians, smaller ones follow detail.
constexpr std::ptrdiff_t kOutlierBlock = 24;
constexpr int kNearest = 8;  // neighbours that confirm a residual
constexpr int kWindow = 20;  // points on each side of the curve that are searched for neighbours
constexpr int kPasses = 4;   // each pass drops the last pass's outliers from the medians
constexpr double kOutlierSds = 6;   // standard deviations; fewer lose detail, more keep errors
constexpr double kGrossSds = 10;    // standard deviations; separates gross errors from a tail
constexpr double kTailShare = 0.2;  // tail's size relative to the gross errors
constexpr double kSimilar = 0.5;  // largest difference of similar residuals, of the point's offset
constexpr double kMinOffset = 4;  // offset that a neighbour can confirm, in its standard deviations
constexpr double kMaxWeight = 4;  // of a point in a weighted median, in median weights

// A point stands on a sheet if at least `least` of the `nearest` points around it are closer to it
// than `within` times its distance from the surface.
struct SheetRule {
  int nearest, least;
  double within;
};
// By chance one gross error in fifty meets the strict rule, and many meet the loose rule.
constexpr SheetRule kStrict = {.nearest = 8, .least = 2, .within = 0.1},
                    kLoose = {.nearest = 20, .least = 2, .within = 0.2};
// Share of the outliers on sheets, beyond chance, that proves steps.
constexpr double kMinStepShare = 0.1;

class OutlierSearch {
 public:
  OutlierSearch(const NestedPoints& points, std::size_t every, const ResidualsBetween& residuals,
                const LeastSpread& least, double far)
      : points_(points),
        every_(every),
        count_(static_cast<std::ptrdiff_t>((points.size() + every - 1) / every)),
        all_(residuals),
        least_(least),
        far_(far) {}

  std::ptrdiff_t count() const { return count_; }

  // Updates `found` from the flags `before`, in the blocks that are `stale` because `before` has
  // changed in or next to them. Returns the blocks whose flags changed.
  std::vector<char> Pass(const std::vector<char>& before, const std::vector<char>& stale,
                         std::vector<char>& found) {
    before_ = &before;
    std::vector<char> changed(stale.size(), 0);
    const std::ptrdiff_t blocks = std::ssize(stale);
    for (std::ptrdiff_t first = 0; first < blocks; first += kBlocksAtOnce) {
      const std::ptrdiff_t last = std::min(first + kBlocksAtOnce, blocks);
      if (std::find(stale.begin() + first, stale.begin() + last, 1) == stale.begin() + last) {
        continue;
      }
      Read(first * kOutlierBlock, std::min(last * kOutlierBlock, count_));
      for (std::ptrdiff_t block = first; block < last; ++block) {
        changed[block] = stale[block] != 0 && PassBlock(block * kOutlierBlock, found) ? 1 : 0;
      }
    }
    return changed;
  }

  // The outliers that meet the loose rule, if enough of them meet the strict rule.
  std::vector<std::ptrdiff_t> OnSheets(const std::vector<char>& found) {
    before_ = &found;
    std::vector<std::ptrdiff_t> outliers;
    for (std::ptrdiff_t k = 0; k < count_; ++k) {
      if (found[k] != 0) {
        outliers.push_back(k);
      }
    }
    if (outliers.empty() || StepShare(outliers) <= kMinStepShare) {
      return {};
    }
    std::erase_if(outliers, [&](std::ptrdiff_t k) {
      MeasureAround(k);
      return !IsOnSheet(k, ResidualVector(k), Offset(k), kLoose);
    });
    return outliers;
  }

 private:
  static constexpr std::ptrdiff_t kBlocksAtOnce = 512;  // residuals per read; bounds the memory

  // Reads the residuals of points begin .. end - 1 and of the windows around them.
  void Read(std::ptrdiff_t begin, std::ptrdiff_t end) {
    first_ = std::max<std::ptrdiff_t>(begin - kWindow, 0);
    residuals_ = all_(first_, std::min(end + kWindow, count_));
  }

  const NestedResidual& Residual(std::ptrdiff_t k) const { return residuals_[k - first_]; }

  // The region around a block, whose points share a median.
  static std::ptrdiff_t RegionBegin(std::ptrdiff_t begin) {
    return std::max<std::ptrdiff_t>(begin - kOutlierBlock / 2, 0);
  }
  std::ptrdiff_t RegionEnd(std::ptrdiff_t end) const {
    return std::min(end + kOutlierBlock / 2, count_);
  }

  void MeasureAround(std::ptrdiff_t k) {
    const std::ptrdiff_t begin = k - k % kOutlierBlock,
                         end = std::min(begin + kOutlierBlock, count_);
    Read(begin, end);
    MeasureRegion(RegionBegin(begin), RegionEnd(end));
  }

  // The share of the outliers (of a sample) that meet the strict rule, less the share that does by
  // chance. For the latter each outlier's residual is tried at the place of another outlier: gross
  // errors that agree by chance, for example because all have the same offset, agree there too.
  double StepShare(const std::vector<std::ptrdiff_t>& outliers) {
    constexpr std::size_t kMaxTested = 300;  // the share's standard error is then below 2 %
    const std::size_t each = std::max<std::size_t>(outliers.size() / kMaxTested, 1);
    int asked = 0, on_sheets = 0;
    for (std::size_t n = 0; n < outliers.size(); n += each) {
      const std::ptrdiff_t here = outliers[n],
                           there = outliers[(n + outliers.size() / 2) % outliers.size()];
      MeasureAround(here);
      const Vec3 left = ResidualVector(here);
      const double off = Offset(here);
      on_sheets += IsOnSheet(here, left, off, kStrict) ? 1 : 0;
      MeasureAround(there);
      on_sheets -= IsOnSheet(there, left, off, kStrict) ? 1 : 0;
      ++asked;
    }
    return static_cast<double>(on_sheets) / asked;
  }

  // Updates the flags of a block. Returns whether any changed.
  bool PassBlock(std::ptrdiff_t begin, std::vector<char>& found) {
    const std::ptrdiff_t end = std::min(begin + kOutlierBlock, count_), around = RegionBegin(begin),
                         behind = RegionEnd(end);
    const bool smooth = points_.weight.empty() && IsSmoothRegion(around, behind);
    if (!smooth) {
      MeasureRegion(around, behind);
    }
    bool changed = false;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      const char is = !smooth && IsFar(k) && !HasSimilarNeighbours(k) ? 1 : 0;
      changed = changed || is != found[k];
      found[k] = is;
    }
    return changed;
  }

  // The region's points that are not flagged, or all of them if too few are not.
  void FindMedianPoints(std::ptrdiff_t begin, std::ptrdiff_t end) {
    median_points_.clear();
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      if ((*before_)[k] == 0) {
        median_points_.push_back(k);
      }
    }
    if (std::ssize(median_points_) < kOutlierBlock / 3) {
      median_points_.resize(end - begin);
      std::iota(median_points_.begin(), median_points_.end(), begin);
    }
  }

  // The median over median_points_.
  template <class Value>
  double Median(const Value& value) {
    values_.clear();
    for (const std::ptrdiff_t k : median_points_) {
      values_.push_back(value(k));
    }
    return UpperMedian(values_);
  }

  // The median over median_points_, weighted by 1 / sigma. It equals Median for equal weights.
  template <class Value>
  double WeightedMedian(const Value& value) {
    if (points_.weight.empty()) {
      return Median(value);
    }
    weighted_values_.clear();
    double left = 0;
    for (const std::ptrdiff_t k : median_points_) {
      weighted_values_.emplace_back(value(k), std::min(Scale(k), max_weight_));
      left += weighted_values_.back().second / 2;
    }
    std::sort(weighted_values_.begin(), weighted_values_.end());
    auto entry = weighted_values_.begin();
    for (; entry + 1 != weighted_values_.end() && left >= entry->second; ++entry) {
      left -= entry->second;
    }
    return entry->first;
  }

  double Scale(std::ptrdiff_t k) const { return points_.Scale(k * every_); }

  // Returns whether no point of the region can be an outlier: a median is at most one standard
  // deviation away from the mean, so no offset can exceed the limit. This saves the medians.
  bool IsSmoothRegion(std::ptrdiff_t begin, std::ptrdiff_t end) const {
    std::array<double, 3> sum{}, squares{};
    double largest = 0;
    char flagged = 0;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      const std::array<double, 3>& e = Residual(k).along;
      flagged = static_cast<char>(flagged | (*before_)[k]);
      for (int c = 0; c < 3; ++c) {
        sum[c] += e[c];
        squares[c] += e[c] * e[c];
      }
      largest = std::max(largest, Residual(k).Square());
    }
    const auto count = static_cast<double>(end - begin);
    double middle = 0;
    for (int c = 0; c < 3; ++c) {
      const double mean = sum[c] / count,
                   reach =
                       std::abs(mean) + std::sqrt(std::max(squares[c] / count - mean * mean, 0.0));
      middle += reach * reach;
    }
    return flagged == 0 && std::sqrt(largest) + std::sqrt(middle) <
                               far_ * std::max(least_.noise_mm, least_.rounding_mm);
  }

  void MeasureRegion(std::ptrdiff_t begin, std::ptrdiff_t end) {
    FindMedianPoints(begin, end);
    const bool weighted = !points_.weight.empty();
    if (weighted) {
      max_weight_ = kMaxWeight * Median([&](std::ptrdiff_t k) { return Scale(k); });
    }
    for (int c = 0; c < points_.channels; ++c) {
      middle_[c] = WeightedMedian([&](std::ptrdiff_t k) { return Residual(k).along[c]; });
    }
    const double sd_of_median = kSdOfMedian[points_.channels];
    spread_mm_ = sd_of_median * WeightedMedian([&](std::ptrdiff_t k) { return Offset(k); });
    const double noise_mm =
        weighted ? sd_of_median * Median([&](std::ptrdiff_t k) { return Scale(k) * Offset(k); })
                 : spread_mm_;
    noise_mm_ = std::max(noise_mm, least_.noise_mm);
  }

  double Noise(std::ptrdiff_t k) const { return noise_mm_ / Scale(k); }

  bool IsFar(std::ptrdiff_t k) const {
    return Offset(k) > far_ * std::max({spread_mm_, Noise(k), least_.rounding_mm});
  }

  double Offset(std::ptrdiff_t k) const {
    double square = 0;
    for (int c = 0; c < points_.channels; ++c) {
      const double off = Residual(k).along[c] - middle_[c];
      square += off * off;
    }
    return std::sqrt(square);
  }

  // Returns whether b has a residual similar to a's.
  bool AreSimilar(std::ptrdiff_t a, std::ptrdiff_t b) const {
    double apart = 0;
    for (int c = 0; c < points_.channels; ++c) {
      const double d = Residual(a).along[c] - Residual(b).along[c];
      apart += d * d;
    }
    return std::sqrt(apart) < kSimilar * Offset(a);
  }

  // The nearest points to k in (u,v) among its window along the curve, if `counts` accepts them; at
  // most `most`.
  template <class Counts>
  std::span<const std::pair<double, std::ptrdiff_t>> Nearest(std::ptrdiff_t k, int most,
                                                             const Counts& counts) {
    near_.clear();
    const std::ptrdiff_t end = std::min(k + kWindow + 1, count_);
    for (std::ptrdiff_t q = std::max<std::ptrdiff_t>(k - kWindow, 0); q < end; ++q) {
      if (q != k && counts(q)) {
        const double dx = points_.X(q * every_) - points_.X(k * every_),
                     dy = points_.Y(q * every_) - points_.Y(k * every_);
        near_.emplace_back(dx * dx + dy * dy, q);
      }
    }
    const std::ptrdiff_t nearest = std::min<std::ptrdiff_t>(most, std::ssize(near_));
    std::partial_sort(near_.begin(), near_.begin() + nearest, near_.end());
    return std::span(near_).first(nearest);
  }

  // Returns whether at least half of the nearest points, among those that can confirm k's offset,
  // have a similar residual.
  bool HasSimilarNeighbours(std::ptrdiff_t k) {
    const double off = Offset(k);
    const auto nearest =
        Nearest(k, kNearest, [&](std::ptrdiff_t q) { return off > kMinOffset * Noise(q); });
    const auto alike = std::ranges::count_if(nearest, [&](const auto& n) {
      return (*before_)[n.second] == 0 && AreSimilar(k, n.second);
    });
    return 2 * alike >= std::ssize(nearest);
  }

  Vec3 ResidualVector(std::ptrdiff_t k) const {
    const std::array<double, 3>& e = Residual(k).along;
    return {e[0], e[1], e[2]};
  }

  // Returns whether point k, moved so that its residual is `left`, stands on a sheet by the rule.
  bool IsOnSheet(std::ptrdiff_t k, const Vec3& left, double off, const SheetRule& rule) {
    const Vec3 place = points_.value[k * every_] - ResidualVector(k) + left;
    const auto nearest = Nearest(k, rule.nearest, [](std::ptrdiff_t) { return true; });
    return std::ranges::count_if(nearest, [&](const auto& n) {
             return (points_.value[n.second * every_] - place).norm() < rule.within * off;
           }) >= rule.least;
  }

  const NestedPoints& points_;
  std::size_t every_;
  std::ptrdiff_t count_;
  const ResidualsBetween& all_;
  std::span<const NestedResidual> residuals_;  // of points first_ ..
  std::ptrdiff_t first_ = 0;
  LeastSpread least_;
  double far_;  // limit of the offset, in standard deviations
  const std::vector<char>* before_ = nullptr;
  std::array<double, 3> middle_{};  // median residual of the region
  double spread_mm_ = 0;            // standard deviation of the region, by a weighted median
  double noise_mm_ = 0;             // of a point of mean weight, if the spread is noise
  double max_weight_ = 0;           // in the weighted medians
  std::vector<std::ptrdiff_t> median_points_;
  std::vector<double> values_;
  std::vector<std::pair<double, double>> weighted_values_;  // value and weight
  std::vector<std::pair<double, std::ptrdiff_t>> near_;
};

// Marks each block that has changed, or that is next to one.
std::vector<char> WithNeighbours(const std::vector<char>& changed) {
  std::vector<char> beside = changed;
  for (std::size_t b = 0; b < changed.size(); ++b) {
    const bool is_next =
        (b > 0 && changed[b - 1] != 0) || (b + 1 < changed.size() && changed[b + 1] != 0);
    beside[b] = beside[b] != 0 || is_next ? 1 : 0;
  }
  return beside;
}

// Repeats passes until no flag changes. A pass updates only the blocks that the last pass affects.
int Search(OutlierSearch search, std::size_t every, std::vector<char>& outlier) {
  static_assert(kWindow < kOutlierBlock);
  std::vector<char> found(search.count());
  for (std::size_t k = 0; k < found.size(); ++k) {
    found[k] = outlier[k * every];
  }
  std::vector<char> stale((found.size() + kOutlierBlock - 1) / kOutlierBlock, 1);
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::vector<char> before = found;
    stale = WithNeighbours(search.Pass(before, stale, found));
    if (before == found) {
      break;
    }
  }
  for (std::size_t k = 0; k < found.size(); ++k) {
    outlier[k * every] = found[k];
  }
  return static_cast<int>(std::count(found.begin(), found.end(), 1));
}

std::vector<std::uint32_t> FlaggedIndices(const std::vector<char>& outlier) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t k = 0; k < outlier.size(); ++k) {
    if (outlier[k] != 0) {
      indices.push_back(k);
    }
  }
  return indices;
}

void SetFlags(const std::vector<std::uint32_t>& indices, std::vector<char>& outlier) {
  std::ranges::fill(outlier, 0);
  for (const std::uint32_t k : indices) {
    outlier[k] = 1;
  }
}

}  // namespace

// Keeps indices of outliers instead of copies of the flags: outliers are few, and points may be ten
// million.
int FindOutliers(const NestedPoints& points, std::size_t every, const ResidualsBetween& residuals,
                 const LeastSpread& least, OutlierTail tail, std::vector<char>& outlier) {
  const std::vector<std::uint32_t> before = FlaggedIndices(outlier);
  const int count = Search({points, every, residuals, least, kOutlierSds}, every, outlier);
  if (count == 0 || tail == OutlierTail::kReject) {
    return count;
  }
  const std::vector<std::uint32_t> far = FlaggedIndices(outlier);
  SetFlags(before, outlier);
  const int fewer = Search({points, every, residuals, least, kGrossSds}, every, outlier);
  if (count - fewer > kTailShare * fewer) {
    return fewer;
  }
  SetFlags(far, outlier);
  return count;
}

int ReinstateStepPoints(const NestedPoints& points, const ResidualsBetween& residuals,
                        const LeastSpread& least, std::vector<char>& outlier) {
  const std::vector<std::ptrdiff_t> on_sheets =
      OutlierSearch(points, /*every=*/1, residuals, least, kOutlierSds).OnSheets(outlier);
  for (const std::ptrdiff_t k : on_sheets) {
    outlier[k] = 0;
  }
  return static_cast<int>(on_sheets.size());
}

}  // namespace semblance::fitting
