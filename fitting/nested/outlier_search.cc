// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/outlier_search.h"
#include "surfaces/base/quantile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

namespace semblance {
namespace {

constexpr std::ptrdiff_t kBlock = 24;  // points that share a median; half as many more on each side
constexpr int kNearest = 8, kWindow = 20, kPasses = 4;
constexpr double kFar = 6, kFarther = 10;
constexpr double kTail = 0.2;  // of those that are farther
constexpr double kAlike = 0.5;
constexpr double kTells = 4;      // standard deviations of a point that it can tell from none
constexpr double kMostVotes = 4;  // of a point, in those of most

// A point stands on a sheet if so many of those nearest to it are within a part of its own distance
// from the surface of it.
struct SheetRule {
  int nearest, least;
  double within;
};
// Of gross errors one in fifty does by chance by the first, and many do by the second.
constexpr SheetRule kSurely = {.nearest = 8, .least = 2, .within = 0.1},
                    kPerhaps = {.nearest = 20, .least = 2, .within = 0.2};
constexpr double kOnSheets = 0.1;  // of the outliers: there are steps

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

  // What follows from `before`, whose last pass has given `found` but where `stale` says that
  // `before` has changed in a block or next to it. Returns the blocks that it changed.
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
      Read(first * kBlock, std::min(last * kBlock, count_));
      for (std::ptrdiff_t block = first; block < last; ++block) {
        changed[block] = stale[block] != 0 && PassBlock(block * kBlock, found) ? 1 : 0;
      }
    }
    return changed;
  }

  // Of the outliers that were found those that perhaps stand on a sheet, if more than chance does
  // surely do.
  std::vector<std::ptrdiff_t> OnSheets(const std::vector<char>& found) {
    before_ = &found;
    std::vector<std::ptrdiff_t> outliers;
    for (std::ptrdiff_t k = 0; k < count_; ++k) {
      if (found[k] != 0) {
        outliers.push_back(k);
      }
    }
    if (outliers.empty() || ShareOnSheets(outliers) <= kOnSheets) {
      return {};
    }
    std::erase_if(outliers, [&](std::ptrdiff_t k) {
      LookAround(k);
      return !IsOnSheet(k, Left(k), Off(k), kPerhaps);
    });
    return outliers;
  }

 private:
  static constexpr std::ptrdiff_t kBlocksAtOnce = 512;

  // The residuals around some blocks.
  void Read(std::ptrdiff_t begin, std::ptrdiff_t end) {
    first_ = std::max<std::ptrdiff_t>(begin - kWindow, 0);
    residuals_ = all_(first_, std::min(end + kWindow, count_));
  }

  const NestedResidual& ResidualOf(std::ptrdiff_t k) const { return residuals_[k - first_]; }

  // The points that share a block's median.
  static std::ptrdiff_t Around(std::ptrdiff_t begin) {
    return std::max<std::ptrdiff_t>(begin - kBlock / 2, 0);
  }
  std::ptrdiff_t Behind(std::ptrdiff_t end) const { return std::min(end + kBlock / 2, count_); }

  void LookAround(std::ptrdiff_t k) {
    const std::ptrdiff_t begin = k - k % kBlock, end = std::min(begin + kBlock, count_);
    Read(begin, end);
    Look(Around(begin), Behind(end));
  }

  // Of the outliers (some of many) less of those that would where others are, as far off as they
  // are here: gross errors agree by chance, the more so if all are off by the same, and one place
  // is then as good as another.
  double ShareOnSheets(const std::vector<std::ptrdiff_t>& outliers) {
    constexpr std::size_t kAsked = 300;
    const std::size_t each = std::max<std::size_t>(outliers.size() / kAsked, 1);
    int asked = 0, on_sheets = 0;
    for (std::size_t n = 0; n < outliers.size(); n += each) {
      const std::ptrdiff_t here = outliers[n],
                           there = outliers[(n + outliers.size() / 2) % outliers.size()];
      LookAround(here);
      const Vec3 left = Left(here);
      const double off = Off(here);
      on_sheets += IsOnSheet(here, left, off, kSurely) ? 1 : 0;
      LookAround(there);
      on_sheets -= IsOnSheet(there, left, off, kSurely) ? 1 : 0;
      ++asked;
    }
    return static_cast<double>(on_sheets) / asked;
  }

  // Whether it changes anything.
  bool PassBlock(std::ptrdiff_t begin, std::vector<char>& found) {
    const std::ptrdiff_t end = std::min(begin + kBlock, count_), around = Around(begin),
                         behind = Behind(end);
    const bool calm = points_.weight.empty() && IsCalm(around, behind);
    if (!calm) {
      Look(around, behind);
    }
    bool changed = false;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      const char is = !calm && IsFar(k) && !HasCompany(k) ? 1 : 0;
      changed = changed || is != found[k];
      found[k] = is;
    }
    return changed;
  }

  // All, if too few have a vote.
  void FindVoters(std::ptrdiff_t begin, std::ptrdiff_t end) {
    voters_.clear();
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      if ((*before_)[k] == 0) {
        voters_.push_back(k);
      }
    }
    if (std::ssize(voters_) < kBlock / 3) {
      voters_.resize(end - begin);
      std::iota(voters_.begin(), voters_.end(), begin);
    }
  }

  // One point, one vote.
  template <class Value>
  double MedianOf(const Value& value) {
    values_.clear();
    for (const std::ptrdiff_t k : voters_) {
      values_.push_back(value(k));
    }
    return UpperMedian(values_);
  }

  // The same value where all are equally sure.
  template <class Value>
  double SureMedianOf(const Value& value) {
    if (points_.weight.empty()) {
      return MedianOf(value);
    }
    voices_.clear();
    double left = 0;
    for (const std::ptrdiff_t k : voters_) {
      voices_.emplace_back(value(k), std::min(ScaleOf(k), most_votes_));
      left += voices_.back().second / 2;
    }
    std::sort(voices_.begin(), voices_.end());
    auto voice = voices_.begin();
    for (; voice + 1 != voices_.end() && left >= voice->second; ++voice) {
      left -= voice->second;
    }
    return voice->first;
  }

  double ScaleOf(std::ptrdiff_t k) const { return points_.Scale(k * every_); }

  // Whether none can be far: a median is no farther from the mean than the standard deviation.
  bool IsCalm(std::ptrdiff_t begin, std::ptrdiff_t end) const {
    std::array<double, 3> sum{}, squares{};
    double largest = 0;
    char voteless = 0;
    for (std::ptrdiff_t k = begin; k < end; ++k) {
      const std::array<double, 3>& e = ResidualOf(k).along;
      voteless = static_cast<char>(voteless | (*before_)[k]);
      for (int c = 0; c < 3; ++c) {
        sum[c] += e[c];
        squares[c] += e[c] * e[c];
      }
      largest = std::max(largest, ResidualOf(k).Square());
    }
    const auto count = static_cast<double>(end - begin);
    double middle = 0;
    for (int c = 0; c < 3; ++c) {
      const double mean = sum[c] / count,
                   reach =
                       std::abs(mean) + std::sqrt(std::max(squares[c] / count - mean * mean, 0.0));
      middle += reach * reach;
    }
    return voteless == 0 && std::sqrt(largest) + std::sqrt(middle) <
                                far_ * std::max(least_.noise_mm, least_.rounding_mm);
  }

  void Look(std::ptrdiff_t begin, std::ptrdiff_t end) {
    FindVoters(begin, end);
    const bool weighted = !points_.weight.empty();
    if (weighted) {
      most_votes_ = kMostVotes * MedianOf([&](std::ptrdiff_t k) { return ScaleOf(k); });
    }
    for (int c = 0; c < points_.channels; ++c) {
      middle_[c] = SureMedianOf([&](std::ptrdiff_t k) { return ResidualOf(k).along[c]; });
    }
    const double sd_of_median = kSdOfMedian[points_.channels];
    spread_mm_ = sd_of_median * SureMedianOf([&](std::ptrdiff_t k) { return Off(k); });
    const double noise_mm =
        weighted ? sd_of_median * MedianOf([&](std::ptrdiff_t k) { return ScaleOf(k) * Off(k); })
                 : spread_mm_;
    noise_mm_ = std::max(noise_mm, least_.noise_mm);
  }

  double NoiseOf(std::ptrdiff_t k) const { return noise_mm_ / ScaleOf(k); }

  bool IsFar(std::ptrdiff_t k) const {
    return Off(k) > far_ * std::max({spread_mm_, NoiseOf(k), least_.rounding_mm});
  }

  double Off(std::ptrdiff_t k) const {
    double square = 0;
    for (int c = 0; c < points_.channels; ++c) {
      const double off = ResidualOf(k).along[c] - middle_[c];
      square += off * off;
    }
    return std::sqrt(square);
  }

  // Whether b is off as a is.
  bool Alike(std::ptrdiff_t a, std::ptrdiff_t b) const {
    double apart = 0;
    for (int c = 0; c < points_.channels; ++c) {
      const double d = ResidualOf(a).along[c] - ResidualOf(b).along[c];
      apart += d * d;
    }
    return std::sqrt(apart) < kAlike * Off(a);
  }

  // Of the points that stand next to it along the curve those nearest to it, but for some.
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

  // Among those that can tell.
  bool HasCompany(std::ptrdiff_t k) {
    const double off = Off(k);
    const auto nearest =
        Nearest(k, kNearest, [&](std::ptrdiff_t q) { return off > kTells * NoiseOf(q); });
    const auto alike = std::ranges::count_if(
        nearest, [&](const auto& n) { return (*before_)[n.second] == 0 && Alike(k, n.second); });
    return 2 * alike >= std::ssize(nearest);
  }

  Vec3 Left(std::ptrdiff_t k) const {
    const std::array<double, 3>& e = ResidualOf(k).along;
    return {e[0], e[1], e[2]};
  }

  // Whether some of those nearest to point k stand where it would, were `left` left of it.
  bool IsOnSheet(std::ptrdiff_t k, const Vec3& left, double off, const SheetRule& rule) {
    const Vec3 place = points_.value[k * every_] - Left(k) + left;
    const auto nearest = Nearest(k, rule.nearest, [](std::ptrdiff_t) { return true; });
    return std::ranges::count_if(nearest, [&](const auto& n) {
             return (points_.value[n.second * every_] - place).norm() < rule.within * off;
           }) >= rule.least;
  }

  const NestedPoints& points_;
  std::size_t every_;
  std::ptrdiff_t count_;
  const ResidualsBetween& all_;
  std::span<const NestedResidual> residuals_;  // from `first_` on
  std::ptrdiff_t first_ = 0;
  LeastSpread least_;
  double far_;  // standard deviations
  const std::vector<char>* before_ = nullptr;
  std::array<double, 3> middle_{};
  double spread_mm_ = 0;  // of the points around, whatever their weights
  double noise_mm_ = 0;   // the same of a point of mean weight, if all of it is noise
  double most_votes_ = 0;
  std::vector<std::ptrdiff_t> voters_;
  std::vector<double> values_;
  std::vector<std::pair<double, double>> voices_;  // values, and how much they count
  std::vector<std::pair<double, std::ptrdiff_t>> near_;
};

}  // namespace

namespace {

// Of each block, whether it or one beside it has changed.
std::vector<char> BesideThose(const std::vector<char>& changed) {
  std::vector<char> beside = changed;
  for (std::size_t b = 0; b < changed.size(); ++b) {
    const bool is_next =
        (b > 0 && changed[b - 1] != 0) || (b + 1 < changed.size() && changed[b + 1] != 0);
    beside[b] = beside[b] != 0 || is_next ? 1 : 0;
  }
  return beside;
}

// A pass looks again only where what the one before has found is news.
int Search(OutlierSearch search, std::size_t every, std::vector<char>& outlier) {
  static_assert(kWindow < kBlock);
  std::vector<char> found(search.count());
  for (std::size_t k = 0; k < found.size(); ++k) {
    found[k] = outlier[k * every];
  }
  std::vector<char> stale((found.size() + kBlock - 1) / kBlock, 1);
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::vector<char> before = found;
    stale = BesideThose(search.Pass(before, stale, found));
    if (before == found) {
      break;
    }
  }
  for (std::size_t k = 0; k < found.size(); ++k) {
    outlier[k * every] = found[k];
  }
  return static_cast<int>(std::count(found.begin(), found.end(), 1));
}

std::vector<std::uint32_t> IndicesOf(const std::vector<char>& outlier) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t k = 0; k < outlier.size(); ++k) {
    if (outlier[k] != 0) {
      indices.push_back(k);
    }
  }
  return indices;
}

void Become(const std::vector<std::uint32_t>& indices, std::vector<char>& outlier) {
  std::ranges::fill(outlier, 0);
  for (const std::uint32_t k : indices) {
    outlier[k] = 1;
  }
}

}  // namespace

// Outliers are few, and points may be ten million: their indices take less than one more flag each.
int FindOutliers(const NestedPoints& points, std::size_t every, const ResidualsBetween& residuals,
                 const LeastSpread& least, OutlierTail tail, std::vector<char>& outlier) {
  const std::vector<std::uint32_t> before = IndicesOf(outlier);
  const int count = Search({points, every, residuals, least, kFar}, every, outlier);
  if (count == 0 || tail == OutlierTail::kGoes) {
    return count;
  }
  const std::vector<std::uint32_t> far = IndicesOf(outlier);
  Become(before, outlier);
  const int fewer = Search({points, every, residuals, least, kFarther}, every, outlier);
  if (count - fewer > kTail * fewer) {
    return fewer;
  }
  Become(far, outlier);
  return count;
}

int SpareSheets(const NestedPoints& points, const ResidualsBetween& residuals,
                const LeastSpread& least, std::vector<char>& outlier) {
  const std::vector<std::ptrdiff_t> on_sheets =
      OutlierSearch(points, /*every=*/1, residuals, least, kFar).OnSheets(outlier);
  for (const std::ptrdiff_t k : on_sheets) {
    outlier[k] = 0;
  }
  return static_cast<int>(on_sheets.size());
}

}  // namespace semblance
