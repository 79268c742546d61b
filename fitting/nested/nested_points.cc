// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_points.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "fitting/nested/error_structure.h"
#include "fitting/nested/neighbour_noise.h"
#include "fitting/nested/outlier_search.h"
#include "fitting/space/point_cloud.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance::fitting {
namespace {

// The shape with more than one level, so that CurveOrder sorts along a Z-curve.
HSplineShape WithLevels(HSplineShape shape) {
  shape.max_level = 1;
  return shape;
}

// Permutes in place, so that the row at order[k] moves to k. It handles one column at a time to
// save memory.
template <class Row>
void SortBy(std::span<const std::uint32_t> order, std::vector<Row>& rows) {
  std::vector<double> column(rows.size());
  for (Eigen::Index c = 0; c < Row::RowsAtCompileTime; ++c) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      column[k] = rows[order[k]][c];
    }
    for (std::size_t k = 0; k < rows.size(); ++k) {
      rows[k][c] = column[k];
    }
  }
}

// Turns positions into displacements from the start, for a bounded number of points at a time.
void SubtractStart(const HSplineSurface& start, std::span<const Vec2> uv, int threads,
                   std::vector<Vec3>& positions) {
  constexpr std::size_t kAtOnce = 1 << 16;  // bounds the memory
  const HSplineBatch batch(start);
  for (std::size_t begin = 0; begin < uv.size(); begin += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, uv.size() - begin);
    const std::vector<Vec3> on_start = batch.Points(uv.subspan(begin, count), threads);
    for (std::size_t k = 0; k < count; ++k) {
      positions[begin + k] -= on_start[k];
    }
  }
}

double Extent(std::span<const Vec3> positions) {
  double largest = 0;
  for (const Vec3& p : positions) {
    largest = std::max(largest, p.cwiseAbs().maxCoeff());
  }
  return largest;
}

// The principal axes along which some displacement exceeds round-off; at least one.
Eigen::Matrix<double, 3, Eigen::Dynamic> PrincipalAxes(const NestedPoints& points, double extent) {
  constexpr double kRelativeRounding = 1e-12;  // relative to the extent
  Mat3 moments = Mat3::Zero();
  for (const Vec3& d : points.value) {
    moments += d * d.transpose();
  }
  const Mat3 all = Eigen::SelfAdjointEigenSolver<Mat3>(moments).eigenvectors();
  Vec3 largest = Vec3::Zero();
  for (const Vec3& d : points.value) {
    largest = largest.cwiseMax((all.transpose() * d).cwiseAbs());
  }
  int channels = 1;
  while (channels < 3 && largest[2 - channels] > kRelativeRounding * extent) {
    ++channels;
  }
  return all.rightCols(channels);
}

using Originals = std::vector<std::uint32_t>;  // per point its original; itself if it is no copy

// Moves the copies to points.repeated. Earlier copies of a point that is now a copy itself become
// near copies of its original.
void SeparateCopies(const Originals& original, NestedPoints& points) {
  std::size_t kept = 0;
  std::map<std::uint32_t, std::uint32_t> original_of;  // given indices
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (original[k] != k) {
      original_of.emplace(points.given[k], points.given[original[k]]);
    }
  }
  for (RepeatedPoint& copy : points.repeated) {
    if (const auto found = original_of.find(copy.first); found != original_of.end()) {
      copy.first = found->second;
      copy.is_exact = false;
    }
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (const std::size_t of = original[k]; of != k) {
      const bool is_exact = points.uv[of] == points.uv[k] && points.value[of] == points.value[k];
      points.repeated.push_back({.given = points.given[k],
                                 .first = points.given[of],
                                 .weight = points.Weight(k),
                                 .is_exact = is_exact,
                                 .uv = points.uv[k],
                                 .value = points.value[k]});
    }
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (original[k] == k) {
      points.uv[kept] = points.uv[k];
      points.value[kept] = points.value[k];
      points.given[kept] = points.given[k];
      if (!points.weight.empty()) {
        points.weight[kept] = points.weight[k];
      }
      ++kept;
    }
  }
  points.uv.resize(kept);
  points.value.resize(kept);
  points.given.resize(kept);
  points.weight.resize(points.weight.empty() ? 0 : kept);
}

// Exact copies are adjacent on the curve.
void SeparateExactCopies(NestedPoints& points) {
  Originals original(points.size());
  std::size_t copies = 0;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    const bool is_copy = k > 0 && points.uv[k] == points.uv[k - 1] &&
                         points.value[k] == points.value[k - 1] &&
                         points.Weight(k) == points.Weight(k - 1);
    original[k] = is_copy ? original[k - 1] : k;
    copies += is_copy ? 1 : 0;
  }
  if (copies > 0) {
    SeparateCopies(original, points);
  }
}

// The spacing of the points and the range of their displacements, by blocks of the curve. A block's
// box is a robust measure of both: most points in it may be copies.
class BlockRanges {
 public:
  struct Range {
    double place = 0;     // spacing in patches of level 0, if no point were a copy
    double value_mm = 0;  // diagonal of the displacements' box
  };
  explicit BlockRanges(const NestedPoints& points) {
    std::vector<Range> of_block;
    for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
      of_block.push_back(Measure(points, begin, std::min(begin + kBlock, points.size())));
    }
    // The median of three blocks, because the curve jumps within some of them.
    for (std::size_t b = 0; b < of_block.size(); ++b) {
      const Range &before = of_block[b == 0 ? b : b - 1], &here = of_block[b],
                  &after = of_block[std::min(b + 1, of_block.size() - 1)];
      ranges_.push_back({MedianOf(before.place, here.place, after.place),
                         MedianOf(before.value_mm, here.value_mm, after.value_mm)});
    }
  }
  const Range& At(std::size_t k) const { return ranges_[k / kBlock]; }

 private:
  static constexpr std::size_t kBlock = 64;

  static double MedianOf(double a, double b, double c) {
    return std::max(std::min(a, b), std::min(std::max(a, b), c));
  }

  static Range Measure(const NestedPoints& points, std::size_t begin, std::size_t end) {
    Eigen::AlignedBox2d places;
    Box3 values;
    for (std::size_t k = begin; k < end; ++k) {
      places.extend(Vec2(points.X(k), points.Y(k)));
      values.extend(points.value[k]);
    }
    return {places.diagonal().norm() / std::sqrt(static_cast<double>(end - begin)),
            values.diagonal().norm()};
  }

  std::vector<Range> ranges_;
};

// Makes the point of each group that was given first the original, since a second export follows
// the first. `original` has one point per group as the original of all others.
void TakeFirstGiven(const NestedPoints& points, Originals& original) {
  Originals first = original;
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    std::uint32_t& of_group = first[original[k]];
    of_group = points.given[k] < points.given[of_group] ? k : of_group;
  }
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    original[k] = first[original[k]];
  }
}

// Calls visit(a, b) for points b that lie within reach(a) of point a, in patches of level 0, and
// behind it along a slanted direction. visit returns whether b is a copy of a; a copy has no copies
// of its own. The direction is slanted so that few points of a lattice lie at one place along it.
template <class Reach, class Visit>
Originals FindCopies(const NestedPoints& points, const Reach& reach, const Visit& visit) {
  const double across = std::cos(1.0), along = std::sin(1.0);
  std::vector<std::pair<double, std::uint32_t>> order;
  Originals original(points.size());
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    order.emplace_back(across * points.X(k) + along * points.Y(k), k);
    original[k] = k;
  }
  std::sort(order.begin(), order.end());
  for (std::size_t n = 0; n < order.size(); ++n) {
    const std::uint32_t a = order[n].second;
    const double end = order[n].first + reach(a);
    for (std::size_t m = n + 1; original[a] == a && m < order.size() && order[m].first <= end;
         ++m) {
      if (const std::uint32_t b = order[m].second;
          original[b] == b && PlaceDistance(points, a, b) <= reach(a) && visit(a, b)) {
        original[b] = a;
      }
    }
  }
  TakeFirstGiven(points, original);
  return original;
}

bool HaveOneWeight(const NestedPoints& points, std::size_t a, std::size_t b) {
  constexpr double kRelative = 1e-3;  // beyond the rounding of a second export
  return std::abs(points.Weight(a) - points.Weight(b)) <= kRelative * points.Weight(a);
}

// Separates points that lie much closer together than their spacing and have one displacement.
void SeparateClosest(NestedPoints& points) {
  constexpr double kPlace = 1e-3, kValue = 1e-3;  // shares of the spacing and of the range
  const BlockRanges ranges(points);
  const auto are_alike = [&](std::size_t a, std::size_t b) {
    return (points.value[a] - points.value[b]).norm() <= kValue * ranges.At(a).value_mm &&
           HaveOneWeight(points, a, b);
  };
  bool some = false;  // no search without a pair among consecutive points
  for (std::size_t k = 1; k < points.size() && !some; ++k) {
    some = PlaceDistance(points, k - 1, k) <= kPlace * ranges.At(k).place && are_alike(k - 1, k);
  }
  if (some) {
    SeparateCopies(
        FindCopies(
            points, [&](std::size_t k) { return kPlace * ranges.At(k).place; }, are_alike),
        points);
  }
}

// Copies that were separated before because their values agree.
std::size_t CountNearCopies(const NestedPoints& points) {
  return static_cast<std::size_t>(
      std::ranges::count(points.repeated, false, &RepeatedPoint::is_exact));
}

// Returns whether most copies differ from their originals by less than half of the noise.
bool ShareTheirErrors(const NestedPoints& points, const Originals& original) {
  constexpr double kShare = 0.5;
  std::vector<std::uint32_t> originals;
  std::vector<double> apart_mm(CountNearCopies(points), 0.0);
  for (std::uint32_t k = 0; k < points.size(); ++k) {
    if (original[k] == k) {
      originals.push_back(k);
    } else {
      apart_mm.push_back(points.Scale(k) * (points.value[k] - points.value[original[k]]).norm());
    }
  }
  const double noise_mm = NeighbourNoise(points, originals, NeighbourModel::kPlaneOf8);
  return kSdOfMedian[points.channels] * UpperMedian(apart_mm) / std::sqrt(2.0) < kShare * noise_mm;
}

// Separates the points of a second export that moved them, if there is one.
void SeparateSecondExport(NestedPoints& points) {
  constexpr double kPlace = 0.05;    // share of the spacing; noise-free neighbours are farther
  constexpr std::size_t kOneIn = 6;  // points that must have an original
  constexpr double kStepsPerSpacing = 2.5;  // on the curve through evenly spread points
  const CurveSteps steps(points);
  const auto reach = [&](std::size_t k) { return kPlace / kStepsPerSpacing * steps.At(k); };
  const std::size_t before = CountNearCopies(points), enough = (points.size() + before) / kOneIn;
  std::size_t close = 0;
  for (std::size_t k = 1; k < points.size(); ++k) {
    close += PlaceDistance(points, k - 1, k) <= reach(k) ? 1 : 0;
  }
  if (before + close < enough / 2) {  // half of the pairs are at least next on the curve
    return;
  }
  const Originals original = FindCopies(
      points, reach, [&](std::size_t a, std::size_t b) { return HaveOneWeight(points, a, b); });
  std::size_t copies = before;
  for (std::size_t k = 0; k < points.size(); ++k) {
    copies += original[k] != k ? 1 : 0;
  }
  if (copies <= enough) {
    return;
  }
  if (ShareTheirErrors(points, original)) {
    SeparateCopies(original, points);
  } else {
    points.measured_twice = static_cast<int>(copies - before);
  }
}

// Turns displacements along x, y and z into displacements along the axes.
void TurnToAxes(NestedPoints& points) {
  const auto turn = [&](Vec3& value) {
    const Vec3 d = value;
    value.setZero();
    for (int c = 0; c < points.channels; ++c) {
      value[c] = points.axes.col(c).dot(d);
    }
  };
  std::ranges::for_each(points.value, turn);
  std::ranges::for_each(points.repeated, turn, &RepeatedPoint::value);
}

}  // namespace

CurveSteps::CurveSteps(const NestedPoints& points) {
  constexpr double kQuantile = 0.9;
  std::vector<double> steps;
  for (std::size_t begin = 0; begin < points.size(); begin += kBlock) {
    steps.clear();
    for (std::size_t k = std::max<std::size_t>(begin, 1);
         k < std::min(begin + kBlock, points.size()); ++k) {
      steps.push_back(PlaceDistance(points, k - 1, k));
    }
    steps_.push_back(steps.empty() ? 0 : Quantile(steps, kQuantile));
  }
}

// If all weights are equal, the mean is exactly this weight, so that equal weights have no effect.
void NestedPoints::UpdateMeanWeight(const std::vector<char>& left_out) {
  double sum = 0, least = std::numeric_limits<double>::infinity(), most = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    if (left_out.empty() || left_out[k] == 0) {
      sum += weight[k];
      least = std::min(least, weight[k]);
      most = std::max(most, weight[k]);
      ++count;
    }
  }
  if (count > 0) {
    mean_weight = least == most ? most : sum / static_cast<double>(count);
  }
}

NestedPoints TakeDisplacements(const HSplineSurface& start, OwnedPoints given, int threads) {
  const HSplineShape shape = WithLevels(start.shape());
  const double extent = Extent(given.positions);
  NestedPoints points;
  points.patches = Vec2(shape.patches_u, shape.patches_v);
  points.periodic_u = shape.ClosedU();
  points.given = CurveOrder(shape, given.View());
  points.lattice_mm = FindLatticeStep(given.positions);
  SubtractStart(start, given.uv, threads, given.positions);
  points.value = std::move(given.positions);
  points.uv = std::move(given.uv);
  SortBy(points.given, points.value);
  SortBy(points.given, points.uv);
  points.weight.reserve(given.weights.size());
  for (std::size_t k = 0; k < given.weights.size(); ++k) {
    points.weight.push_back(given.weights[points.given[k]]);
  }
  SeparateExactCopies(points);
  SeparateClosest(points);
  points.UpdateMeanWeight({});
  points.weighted =
      std::ranges::any_of(points.weight, [&](double weight) { return weight != points.weight[0]; });
  points.axes = PrincipalAxes(points, extent);
  points.channels = static_cast<int>(points.axes.cols());
  TurnToAxes(points);
  SeparateSecondExport(points);
  points.UpdateMeanWeight({});
  return points;
}

NestedPoints DisplacementsFrom(const HSplineSurface& start, const ScatteredPoints& given,
                               int threads) {
  return TakeDisplacements(
      start,
      OwnedPoints{.positions = {given.positions.begin(), given.positions.end()},
                  .uv = {given.uv.begin(), given.uv.end()},
                  .weights = {given.weights.begin(), given.weights.end()}},
      threads);
}

std::vector<Vec2> UvAsGiven(NestedPoints points) {
  points.value = std::vector<Vec3>();  // frees it, which {} would not
  points.weight = std::vector<double>();
  const std::size_t kept = points.size();
  std::vector<double> column(points.GivenSize());
  points.uv.resize(column.size());
  for (const int c : {0, 1}) {
    for (std::size_t k = 0; k < kept; ++k) {
      column[points.given[k]] = points.uv[k][c];
    }
    for (const RepeatedPoint& copy : points.repeated) {
      column[copy.given] = copy.uv[c];
    }
    for (std::size_t k = 0; k < column.size(); ++k) {
      points.uv[k][c] = column[k];
    }
  }
  return std::move(points.uv);
}

}  // namespace semblance::fitting
