// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/points_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// The coordinates of points along an axis, ascending, with the points' indices.
using Along = std::vector<std::pair<double, std::size_t>>;

// The number of points that may be strays.
std::size_t MostStrays(std::size_t count) { return std::max<std::size_t>(count / 50, 1); }

// The range of all coordinates but the outermost that may be strays.
double InnerRange(std::span<const std::pair<double, std::size_t>> along) {
  const std::size_t outer = MostStrays(along.size());
  return along.size() > 2 * outer ? along[along.size() - 1 - outer].first - along[outer].first : 0;
}

// Returns whether programs write this number for a missing one: 0, -99, 9999, -32768, 1e20. Another
// number that many points share is a place, such as the height of a flat roof.
bool StandsForNoData(double value) {
  constexpr std::array kNumbers = {0.0, 99.0, 999.0, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0};
  constexpr double kHuge = 1e10;
  return std::abs(value) >= kHuge || std::ranges::count(kNumbers, std::abs(value)) > 0;
}

// The heights without a number for missing ones that several points share at an end. Such a number
// says nothing of the spread. One that half of the points have stays.
Along WithoutNoData(Along along) {
  const auto count_first = [](const Along& from) {
    const auto other = std::ranges::find_if(
        from, [&](const auto& entry) { return entry.first != from.front().first; });
    const auto count = other - from.begin();
    return count < 2 || 2 * count >= std::ssize(from) || !StandsForNoData(from.front().first)
               ? 0
               : count;
  };
  for (int end = 0; end < 2; ++end) {
    along.erase(along.begin(), along.begin() + count_first(along));
    std::ranges::reverse(along);
  }
  return along;
}

// The first of several points with one value beyond all others, such as -9999 or 0 for no data; the
// size if there are none. widest: the widest inner range of the other axes.
std::size_t FindOneValue(const Along& along, double widest) {
  constexpr double kFar = 2;  // inner ranges between the value and the others
  std::size_t first = along.empty() ? 0 : along.size() - 1;
  while (first > 0 && along[first - 1].first == along.back().first) {
    --first;
  }
  if (along.size() - first < 2 || first < along.size() / 2 || first == 0) {
    return along.size();
  }
  const double range = std::max(widest, InnerRange(std::span(along).first(first)));
  return along[first].first - along[first - 1].first > kFar * range ? first : along.size();
}

// The first of a few points beyond a gap; the size if there are none.
std::size_t FindFew(const Along& along, double widest) {
  constexpr double kFar = 3, kFarOfWidest = 1.5;  // inner ranges, of this axis and of any
  const double range = InnerRange(along),
               gap = std::max(kFar * range, kFarOfWidest * std::max(widest, range));
  const std::size_t count = along.size(), most = std::min(MostStrays(count) + 1, count);
  for (std::size_t k = count - most; k + 1 < count; ++k) {
    if (along[k + 1].first - along[k].first > gap) {
      return k + 1;
    }
  }
  return count;
}

// Finds points far beyond all others along a coordinate axis. They would squeeze the others into a
// corner of (u,v). Heights z count by their spread, because they may have another unit.
class StraySearch {
 public:
  // left_out: per point; the flags of strays are set.
  StraySearch(std::span<const Vec3> positions, std::vector<char>& left_out)
      : positions_(positions), left_out_(left_out) {
    // Spread of z relative to that of x and y. Lower values keep more points above the others.
    constexpr double kShareOfPlaces = 0.3;
    const std::size_t every = std::max<std::size_t>(positions_.size() / kSample, 1);
    const double height = InnerRange(WithoutNoData(SortedAlong(2, every))),
                 place =
                     std::max(InnerRange(SortedAlong(0, every)), InnerRange(SortedAlong(1, every)));
    units_.z() = height > 0 && place > 0 ? kShareOfPlaces * place / height : 1;
  }

  void Run() {
    for (int round = 0; round < 2 && HasFarPoints(); ++round) {  // one kind may hide the other
      Flag(FindOneValue);
      Flag(FindFew);
    }
  }

 private:
  // Returns whether some point is so far from the quartiles of a sample that a search may find it.
  bool HasFarPoints() const {
    constexpr double kFar = 2.5;  // distances between quartiles, the widest
    Vec3 low = Vec3::Zero(), high = Vec3::Zero(), beyond = Vec3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Along along = SortedAlong(axis, std::max<std::size_t>(positions_.size() / kSample, 1));
      if (along.empty()) {
        return false;
      }
      low[axis] = along[along.size() / 4].first;
      high[axis] = along[along.size() * 3 / 4].first;
    }
    for (std::size_t k = 0; k < positions_.size(); ++k) {
      if (left_out_[k] == 0) {
        const Vec3 p = positions_[k].cwiseProduct(units_);
        beyond = beyond.cwiseMax(low - p).cwiseMax(p - high);
      }
    }
    return beyond.maxCoeff() > kFar * (high - low).maxCoeff();
  }

  Along SortedAlong(int axis, std::size_t every) const {
    Along along;
    for (std::size_t k = 0; k < positions_.size(); k += every) {
      if (left_out_[k] == 0) {
        along.emplace_back(units_[axis] * positions_[k][axis], k);
      }
    }
    std::sort(along.begin(), along.end());
    return along;
  }

  // Flags the points that `find` finds at either end of an axis.
  template <class Find>
  void Flag(const Find& find) {
    std::array<Along, 3> along;
    Vec3 range;
    for (int axis = 0; axis < 3; ++axis) {
      along[axis] = SortedAlong(axis, 1);
      range[axis] = InnerRange(along[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double widest = std::max(range[(axis + 1) % 3], range[(axis + 2) % 3]);
      for (int end = 0; end < 2; ++end) {
        for (std::size_t k = find(along[axis], widest); k < along[axis].size(); ++k) {
          left_out_[along[axis][k].second] = 1;
        }
        std::ranges::reverse(along[axis]);
        std::ranges::for_each(along[axis], [](auto& entry) { entry.first *= -1; });
      }
    }
  }

  static constexpr std::size_t kSample = 10000;
  std::span<const Vec3> positions_;
  std::vector<char>& left_out_;
  Vec3 units_ = Vec3::Ones();  // factors of x, y and z
};

// Takes the points out of the table, with the triangles at them.
void TakeOut(std::span<const char> left_out, PointTable& table) {
  std::vector<std::int32_t> number(left_out.size());
  std::int32_t kept = 0;
  for (std::size_t k = 0; k < left_out.size(); ++k) {
    number[k] = left_out[k] == 0 ? kept++ : -1;
  }
  Keep(left_out, table.positions);
  Keep(left_out, table.uv);
  Keep(left_out, table.weights);
  for (Triangle& triangle : table.triangles) {
    std::ranges::for_each(triangle, [&](std::int32_t& corner) { corner = number[corner]; });
  }
  std::erase_if(table.triangles, [](const Triangle& t) { return std::ranges::min(t) < 0; });
  for (std::uint32_t& point : table.exact) {
    point = static_cast<std::uint32_t>(number[point]);
  }
}

// Spreads values of the points that take part over all given points; NaN elsewhere.
template <class Value>
void SpreadBack(const PointsOut& out, const Value& none, std::vector<Value>& values) {
  std::vector<Value> all(values.empty() ? 0 : out.left_out.size(), none);
  for (std::size_t n = 0; n < values.size(); ++n) {
    all[out.given[n]] = values[n];
  }
  values = std::move(all);
}

}  // namespace

PointsOut LeaveOut(PointTable& table, bool uv_given) {
  PointsOut out{.left_out = std::vector<char>(table.positions.size(), 0), .strays = {}};
  for (std::size_t k = 0; k < table.positions.size(); ++k) {
    out.left_out[k] = table.positions[k].allFinite() ? 0 : 1;
    out.not_finite += out.left_out[k];
  }
  std::vector<char> far = out.left_out;
  if (!uv_given && table.exact.empty()) {
    StraySearch(table.positions, far).Run();
  }
  for (std::uint32_t k = 0; k < far.size(); ++k) {
    if (far[k] != out.left_out[k]) {
      out.strays.push_back(k);
    }
    out.left_out[k] = far[k];
  }
  for (const std::uint32_t point : table.exact) {
    if (out.left_out[point] != 0) {
      throw InputError(
          fmt::format("{} is exact and not finite; give its coordinates", PointName(table, point)));
    }
  }
  if (out.Any()) {
    for (std::uint32_t k = 0; k < far.size(); ++k) {
      if (far[k] == 0) {
        out.given.push_back(k);
      }
    }
    TakeOut(out.left_out, table);
  }
  return out;
}

void RestoreOrder(const PointsOut& out, PointFit& result) {
  result.strays = out.strays;
  result.not_finite = out.not_finite;
  if (!out.Any()) {
    return;
  }
  SpreadBack(out, Vec2(Vec2::Constant(kNaN)), result.fit.uv);
  SpreadBack(out, kNaN, result.fit.residual_mm);
  SpreadBack(out, kNaN, result.sigma_mm);
  SpreadBack(out, kNaN, result.weights);
  for (std::vector<double>& values : result.attribute_at) {
    SpreadBack(out, kNaN, values);
  }
  if (result.fit.automatic) {
    AutoReport& report = *result.fit.automatic;
    for (std::vector<std::uint32_t>* const indices : {&report.outliers, &report.repeated}) {
      std::ranges::for_each(*indices, [&](std::uint32_t& k) { k = out.given[k]; });
    }
    std::vector<std::uint32_t> outliers;
    std::ranges::set_union(report.outliers, out.strays, std::back_inserter(outliers));
    report.outliers = std::move(outliers);
  }
}

}  // namespace semblance::problems
