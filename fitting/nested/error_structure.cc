// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/error_structure.h"

#include <algorithm>
#include <cmath>

#include "surfaces/base/quantile.h"

namespace semblance::fitting {

double FindLatticeStep(std::span<const Vec3> positions) {
  constexpr std::size_t kSample = 4000;     // bounds the time of most files
  constexpr double kWhole = 1e-3;           // of a step, beyond rounding
  constexpr double kRoundOff = 1e-9;        // of the range
  constexpr std::size_t kFewestValues = 8;  // fewer are terraces rather than rounded heights
  constexpr std::size_t kSharing = 2;       // points that share a value on average, at least
  std::vector<double> values;
  for (std::size_t k = 0; k < positions.size();
       k += std::max<std::size_t>(positions.size() / kSample, 1)) {
    values.push_back(positions[k].z());
  }
  std::ranges::sort(values);
  const double range = values.empty() ? 0 : values.back() - values.front();
  double step = 0;
  std::size_t distinct = 1;
  for (std::size_t k = 1; k < values.size(); ++k) {
    const double gap = values[k] - values[k - 1];
    if (gap > kRoundOff * range) {
      step = step > 0 ? std::min(step, gap) : gap;
      ++distinct;
    }
  }
  if (!(step > 0) || distinct < kFewestValues || kSharing * distinct > values.size()) {
    return 0;
  }
  const auto is_whole = [&](const Vec3& p) {
    const double steps = (p.z() - values.front()) / step;
    return std::abs(steps - std::round(steps)) < kWhole;
  };
  return std::ranges::all_of(positions, is_whole) ? step : 0;
}

bool LieAlongLines(const NestedPoints& points) {
  constexpr std::size_t kProbes = 300;
  constexpr std::ptrdiff_t kWindow = 24, kNear = 8;
  constexpr double kNarrow = 0.05;  // mean square across over along; evenly spread points have 0.3
  std::vector<double> ratios;
  const auto count = static_cast<std::ptrdiff_t>(points.size());
  for (std::ptrdiff_t k = 0; k < count;
       k += std::max<std::ptrdiff_t>(count / static_cast<std::ptrdiff_t>(kProbes), 1)) {
    std::vector<std::array<double, 3>> near;  // squared distance, then the way
    for (std::ptrdiff_t n = std::max<std::ptrdiff_t>(k - kWindow, 0);
         n < std::min(k + kWindow + 1, count); ++n) {
      const double x = points.X(n) - points.X(k), y = points.Y(n) - points.Y(k);
      near.push_back({x * x + y * y, x, y});
    }
    std::ranges::sort(near);
    double xx = 0, xy = 0, yy = 0;
    for (std::ptrdiff_t n = 0; n < std::min(kNear + 1, std::ssize(near)); ++n) {
      const auto [square, x, y] = near[n];
      xx += x * x;
      xy += x * y;
      yy += y * y;
    }
    const double half = (xx + yy) / 2, root = std::hypot((xx - yy) / 2, xy);
    ratios.push_back(half + root > 0 ? (half - root) / (half + root) : 1);
  }
  return !ratios.empty() && UpperMedian(ratios) < kNarrow;
}

namespace {

constexpr std::size_t kAlong = 4;  // points on each side of a turn; fewer turn by chance

// Returns whether the way of the points turns back at the n-th, as at the end of a line that is
// followed by the next in the other direction.
bool TurnsBack(const NestedPoints& points, const std::vector<std::uint32_t>& order, std::size_t n) {
  constexpr double kBack = -0.7;  // cosine
  if (n < kAlong || n + kAlong >= order.size()) {
    return false;
  }
  const auto place = [&](std::size_t k) { return Vec2(points.X(order[k]), points.Y(order[k])); };
  const Vec2 before = place(n - 1) - place(n - kAlong), after = place(n + kAlong) - place(n);
  return before.dot(after) < kBack * before.norm() * after.norm();
}

}  // namespace

FileRuns FindFileRuns(const NestedPoints& points) {
  constexpr double kNeighbour = 0.05;  // of the domain's diagonal: the largest median step
  constexpr double kFar = 20;          // median steps between two runs
  constexpr std::size_t kShortest = 8, kFewestRuns = 20;
  constexpr std::size_t kMostPoints = 2'000'000;  // bounds the memory
  if (points.size() > kMostPoints) {
    return {};
  }
  std::vector<std::uint32_t> curve_of(points.GivenSize(), FileRuns::kNone);
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    curve_of[points.given[k]] = k;
  }
  std::erase(curve_of, FileRuns::kNone);
  std::vector<double> steps;
  for (std::size_t n = 1; n < curve_of.size(); ++n) {
    steps.push_back(PlaceDistance(points, curve_of[n - 1], curve_of[n]));
  }
  if (steps.size() < kShortest * kFewestRuns) {
    return {};
  }
  std::vector<double> sorted = steps;
  const double median = UpperMedian(sorted);
  if (!(median > 0 && median < kNeighbour * points.patches.norm())) {
    return {};
  }
  const auto is_far = [&](double step) { return !(step < kFar * median); };
  const auto ends_before = [&](std::size_t begin, std::size_t n) {
    if (is_far(steps[n - 1])) {
      return true;
    }
    const auto next = steps.begin() + static_cast<std::ptrdiff_t>(n);
    const auto ahead = std::min<std::ptrdiff_t>(kAlong, steps.end() - next);
    return n - begin >= kShortest && std::none_of(next, next + ahead, is_far) &&
           TurnsBack(points, curve_of, n);
  };
  FileRuns runs{.run = std::vector<std::uint32_t>(points.size(), FileRuns::kNone)};
  for (std::size_t begin = 0, end = 1; begin < curve_of.size(); begin = end, ++end) {
    while (end < curve_of.size() && !ends_before(begin, end)) {
      ++end;
    }
    for (std::size_t n = begin; n < end && end - begin >= kShortest; ++n) {
      runs.run[curve_of[n]] = runs.count;
    }
    runs.count += end - begin >= kShortest ? 1 : 0;
  }
  return runs.count >= kFewestRuns ? runs : FileRuns();
}

namespace {

void AddTo(NestedResidual& sum, const NestedResidual& residual) {
  for (std::size_t c = 0; c < sum.along.size(); ++c) {
    sum.along[c] += residual.along[c];
  }
}

// The effect if it is certain, else 1. Sums of independent errors have squares with a relative
// standard error of sqrt(2 / blocks).
double CertainEffect(double effect, std::size_t blocks) {
  constexpr double kErrors = 3;
  return blocks > 0 && effect > 1 + kErrors * std::sqrt(2.0 / static_cast<double>(blocks)) ? effect
                                                                                           : 1;
}

}  // namespace

void DesignEffect::Add(std::size_t k, const NestedResidual& residual) {
  squares_ += residual.Square();
  ++count_;
  for (std::size_t b = 0; b < kBlocks.size(); ++b) {
    Sums& sums = sums_[b];
    AddTo(sums.sum, residual);
    if (count_ % kBlocks[b] == 0) {
      sums.squares_of_sums += sums.sum.Square();
      ++sums.blocks;
      sums.sum = {};
    }
  }
  if (runs_.count > 0 && runs_.run[k] != FileRuns::kNone) {
    RunSum& run = of_runs_[runs_.run[k]];
    AddTo(run.sum, residual);
    ++run.count;
  }
}

double DesignEffect::Value() const {
  const double square = squares_ / std::max<double>(static_cast<double>(count_), 1);
  double largest = 1;
  for (std::size_t b = 0; b < kBlocks.size() && square > 0; ++b) {
    const double independent =
        square * static_cast<double>(kBlocks[b]) * static_cast<double>(sums_[b].blocks);
    largest =
        std::max(largest, CertainEffect(sums_[b].squares_of_sums / independent, sums_[b].blocks));
  }
  double squares_of_sums = 0, in_runs = 0;
  for (const RunSum& run : of_runs_) {
    squares_of_sums += run.sum.Square();
    in_runs += static_cast<double>(run.count);
  }
  return in_runs > 0 && square > 0
             ? std::max(largest, CertainEffect(squares_of_sums / (square * in_runs), runs_.count))
             : largest;
}

namespace {

constexpr std::ptrdiff_t kAround = 4;  // points of the curve on each side of an outlier

}  // namespace

std::vector<std::uint32_t> FindOutliersTogether(const std::vector<char>& outlier) {
  std::vector<std::uint32_t> together;
  for (std::ptrdiff_t k = 0; k < std::ssize(outlier); ++k) {
    const auto begin = outlier.begin() + std::max<std::ptrdiff_t>(k - kAround, 0),
               end = outlier.begin() + std::min(k + kAround + 1, std::ssize(outlier));
    if (outlier[k] != 0 && std::count(begin, end, 1) > 1) {
      together.push_back(static_cast<std::uint32_t>(k));
    }
  }
  return together;
}

bool StandTogether(const std::vector<char>& outlier) {
  constexpr double kFewest = 20;
  constexpr double kBeyondChance = 0.3;
  const auto outliers = static_cast<double>(std::ranges::count(outlier, 1));
  if (outliers < kFewest) {
    return false;
  }
  const double share = outliers / static_cast<double>(outlier.size()),
               by_chance = 1 - std::pow(1 - share, 2 * kAround);
  return static_cast<double>(FindOutliersTogether(outlier).size()) >
         (by_chance + kBeyondChance) * outliers;
}

}  // namespace semblance::fitting
