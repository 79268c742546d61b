// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/file_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "surfaces/base/quantile.h"

namespace semblance::problems {
namespace {

constexpr std::size_t kNeighbours = 8;

// A height, and how it differs from the mean of its neighbours.
struct Difference {
  std::size_t point = 0;
  bool is_zero = false, has_other_neighbours = false;  // most neighbours are not 0
  double above = kNaN;
};

class NeighbourSearch {
 public:
  NeighbourSearch(std::span<const Vec3> positions, std::span<const Vec2> uv)
      : positions_(positions), uv_(uv) {
    constexpr std::size_t kMost = 600;  // points; the time grows with their square: 600 take 5 ms
    for (std::size_t k = 0; k < uv.size(); k += uv.size() / kMost + 1) {
      sample_.push_back(k);
    }
    order_.resize(sample_.size());
  }

  std::vector<Difference> Run() {
    std::vector<Difference> differences;
    if (sample_.size() > 2 * kNeighbours) {
      for (const std::size_t point : sample_) {
        differences.push_back(Compare(point));
      }
    }
    return differences;
  }

 private:
  double Height(std::size_t point) const { return positions_[point].z(); }

  Difference Compare(std::size_t point) {
    for (std::size_t n = 0; n < sample_.size(); ++n) {
      order_[n] = {(uv_[sample_[n]] - uv_[point]).squaredNorm(), sample_[n]};
    }
    // The nearest one is the point itself, or a point at the same place.
    std::ranges::nth_element(order_, order_.begin() + kNeighbours);
    double sum = 0;
    std::size_t others = 0, count = 0;
    for (std::size_t n = 0; n <= kNeighbours; ++n) {
      if (const std::size_t neighbour = order_[n].second; neighbour != point) {
        sum += Height(neighbour);
        others += Height(neighbour) != 0;
        ++count;
      }
    }
    return {.point = point,
            .is_zero = Height(point) == 0,
            .has_other_neighbours = 2 * others > count,
            .above = Height(point) - sum / static_cast<double>(count)};
  }

  std::span<const Vec3> positions_;
  std::span<const Vec2> uv_;
  std::vector<std::size_t> sample_;
  std::vector<std::pair<double, std::size_t>> order_;
};

// The split of a row of values into two parts whose means differ most.
struct Split {
  std::size_t first = 0;  // of the second part
  double share = 0;       // of the variance that the parts' means explain
  double step = 0;        // mean of the second part less that of the first
};

Split FindSplit(std::span<const Difference> row) {
  const auto count = static_cast<double>(row.size());
  double sum = 0, squares = 0, before = 0;
  for (const Difference& d : row) {
    sum += d.above;
    squares += d.above * d.above;
  }
  Split best;
  for (std::size_t k = 1; k < row.size(); ++k) {
    before += row[k - 1].above;
    const double n = static_cast<double>(k), step = (sum - before) / (count - n) - before / n,
                 explained = step * step * n * (count - n) / count;
    if (const double share = explained / (squares - sum * sum / count); share > best.share) {
      best = {.first = k, .share = share, .step = step};
    }
  }
  return best;
}

std::string DescribeParts(std::span<const Difference> row) {
  // More than what any order of the points explained in files of one survey: a few percent.
  constexpr double kShare = 0.5;
  constexpr std::size_t kFewest = 10;  // points of the sample in each part
  const Split split = FindSplit(row);
  if (!(split.share > kShare) || split.first < kFewest || row.size() - split.first < kFewest) {
    return "";
  }
  return fmt::format(
      "the first {} points lie {:.3g} {} than those behind them in the file, over the same ground, "
      "as two surveys with other zeros of height: bring both to one, or fit each alone",
      row[split.first].point, std::abs(split.step), split.step < 0 ? "higher" : "lower");
}

std::string DescribeZeros(std::span<const Difference> row) {
  constexpr std::size_t kFewest = 3;
  constexpr double kMuchMore = 4;  // true zeros differ from their neighbours as other heights do
  std::vector<double> zeros, others;
  std::size_t all = 0;
  for (const Difference& d : row) {
    all += d.is_zero;
    if (!d.is_zero) {
      others.push_back(std::abs(d.above));
    } else if (d.has_other_neighbours) {
      zeros.push_back(std::abs(d.above));
    }
  }
  if (zeros.size() < kFewest || 2 * zeros.size() < all || others.size() < all) {
    return "";
  }
  const double zero = UpperMedian(zeros), other = UpperMedian(others);
  return zero > kMuchMore * other
             ? fmt::format(
                   "heights of exactly 0 differ from their neighbours by {:.3g} (median), and "
                   "other "
                   "heights by {:.3g}: 0 may stand for a missing height; leave these points out",
                   zero, other)
             : "";
}

// The points of the sorted row up to the widest gap between their distances from the origin, if it
// is wide enough for two units.
std::size_t CountBeforeGap(std::span<const std::pair<double, std::size_t>> row) {
  constexpr double kWideGap = 3;       // ratio of distances; the least factor is 10
  constexpr std::size_t kOneIn = 50;   // points in each part at least; fewer may be strays
  constexpr std::size_t kFewest = 10;  // of the same
  const std::size_t fewest = std::max(row.size() / kOneIn, kFewest);
  std::size_t best = 0;
  double widest = kWideGap;
  for (std::size_t k = fewest; k + fewest < row.size(); ++k) {
    if (const double gap = row[k].first / row[k - 1].first; gap > widest) {
      widest = gap;
      best = k;
    }
  }
  return best;
}

// Returns whether the box `less`, multiplied by the factor, lies in the place of the other: along
// two axes they share most of their length, and along the third they are not far apart.
bool CoverEachOther(const Box3& less, const Box3& more, double factor) {
  constexpr double kShared = 0.5;  // of the union
  int shared = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = factor * less.min()[axis], high = factor * less.max()[axis],
                 both = std::min(high, more.max()[axis]) - std::max(low, more.min()[axis]),
                 all = std::max(high, more.max()[axis]) - std::min(low, more.min()[axis]);
    shared += both > kShared * all;
    if (-both > kShared * all) {
      return false;
    }
  }
  return shared >= 2;
}

}  // namespace

std::string FindPartInAnotherUnit(std::span<const Vec3> positions) {
  constexpr std::size_t kMost = 20'000;  // points that are looked at; more take more time
  std::vector<std::pair<double, std::size_t>> row;
  for (std::size_t k = 0; k < positions.size(); k += positions.size() / kMost + 1) {
    row.emplace_back(positions[k].norm(), k);
  }
  std::ranges::sort(row);
  const std::size_t near = CountBeforeGap(row);
  if (near == 0) {
    return "";
  }
  Box3 less, more;
  for (std::size_t n = 0; n < row.size(); ++n) {
    (n < near ? less : more).extend(positions[row[n].second]);
  }
  for (const double factor : {10.0, 12.0, 25.4, 100.0, 1000.0}) {
    if (CoverEachOther(less, more, factor)) {
      return fmt::format(
          "{:.0f} % of the points, such as number {}, lie near the origin, and times {} they lie "
          "among the others: a part of the file may be in another unit; bring all points to one",
          100.0 * static_cast<double>(near) / static_cast<double>(row.size()), row[0].second + 1,
          factor);
    }
  }
  return "";
}

std::vector<std::string> FindHeightMistakes(std::span<const Vec3> positions,
                                            std::span<const Vec2> uv) {
  const std::vector<Difference> row = NeighbourSearch(positions, uv).Run();
  std::vector<std::string> findings;
  for (std::string text : {DescribeParts(row), DescribeZeros(row)}) {
    if (!text.empty()) {
      findings.push_back(std::move(text));
    }
  }
  return findings;
}

}  // namespace semblance::problems
