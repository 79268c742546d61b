// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/slice_stack.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

constexpr double kSamePlace_mm = 0.02;
constexpr double kOffShare = 0.1;  // of a step, or of a pixel: how far a slice may be off
constexpr double kLeastOff_mm = 0.1;
constexpr double kMostSteps = 1e4;  // between neighbours; what is farther off is of another scan

// At most four of the items, and how many there are.
std::string Some(const std::vector<std::string>& items) {
  constexpr std::size_t kMost = 4;
  if (items.size() <= kMost) {
    return fmt::format("{}", fmt::join(items, ", "));
  }
  return fmt::format("{} and {} more", fmt::join(items.begin(), items.begin() + kMost, ", "),
                     items.size() - kMost);
}

// A slice and its height along the normal.
struct Level {
  int slice = -1;
  double height_mm = kNaN;
};

std::vector<Level> SortedLevels(std::span<const Vec3> positions, const Vec3& normal) {
  std::vector<Level> levels;
  for (const Vec3& p : positions) {
    levels.push_back({static_cast<int>(levels.size()), p.dot(normal)});
  }
  std::ranges::stable_sort(levels, {}, &Level::height_mm);
  return levels;
}

// Leaves the first slice at each place.
std::vector<Level> WithoutDoubles(const std::vector<Level>& levels,
                                  std::span<const std::string> names, const StackOptions& options,
                                  const std::string& where, std::vector<std::string>& notes) {
  std::vector<Level> kept;
  std::vector<std::string> doubles;
  for (const Level& level : levels) {
    if (kept.empty() || level.height_mm - kept.back().height_mm > kSamePlace_mm) {
      kept.push_back(level);
    } else {
      doubles.push_back(fmt::format("{:.2f} mm ({} and {})", level.height_mm,
                                    names[kept.back().slice], names[level.slice]));
    }
  }
  if (!doubles.empty() && !options.fill) {
    throw InputError(fmt::format(
        "{}: {} doubled slices, at {} along the normal: the series holds two scans or copies; "
        "remove one of each pair, or say fill_slices, which takes the first",
        where, doubles.size(), Some(doubles)));
  }
  if (!doubles.empty()) {
    notes.push_back(fmt::format("{} doubled slices, the first of each pair taken: at {}",
                                doubles.size(), Some(doubles)));
  }
  return kept;
}

// The distance of most neighbours.
double UsualStep(const std::vector<Level>& levels) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    steps.push_back(levels[k].height_mm - levels[k - 1].height_mm);
  }
  return UpperMedian(steps);
}

// Which place of a regular stack each level has.
std::vector<int> Places(const std::vector<Level>& levels, const std::string& where) {
  const double step = UsualStep(levels);
  std::vector<int> places = {0};
  std::vector<std::string> odd;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    const double apart = (levels[k].height_mm - levels[k - 1].height_mm) / step;
    const int steps = static_cast<int>(std::lround(std::clamp(apart, 1.0, kMostSteps)));
    places.push_back(places.back() + steps);
    if (std::abs(apart - steps) > std::max(kOffShare, kLeastOff_mm / step)) {
      odd.push_back(
          fmt::format("{:.2f} to {:.2f} mm", levels[k - 1].height_mm, levels[k].height_mm));
    }
  }
  if (!odd.empty()) {
    throw InputError(fmt::format(
        "{}: the slices are not at equal distances: most are {:.2f} mm apart, and not those at {} "
        "along the normal; export the series again, resampled to equal distances",
        where, step, Some(odd)));
  }
  return places;
}

// Tells the gaps; an error unless they are to be filled and are short.
void CheckGaps(const std::vector<Level>& levels, const std::vector<int>& places,
               const StackOptions& options, const std::string& where,
               std::vector<std::string>& notes) {
  std::vector<std::string> gaps;
  double longest_mm = 0;
  int missing = 0;
  for (std::size_t k = 1; k < levels.size(); ++k) {
    if (places[k] - places[k - 1] > 1) {
      const double low = levels[k - 1].height_mm, high = levels[k].height_mm;
      gaps.push_back(fmt::format("between {:.2f} and {:.2f} mm", low, high));
      longest_mm = std::max(longest_mm, high - low);
      missing += places[k] - places[k - 1] - 1;
    }
  }
  if (gaps.empty()) {
    return;
  }
  const std::string what =
      fmt::format("{} missing slices, {} along the normal", missing, Some(gaps));
  if (!options.fill) {
    throw InputError(fmt::format(
        "{}: {}; add their files, or say fill_slices, which interpolates them", where, what));
  }
  if (longest_mm > options.longest_fill_mm) {
    throw InputError(fmt::format(
        "{}: {}; the longest gap is {:.1f} mm, and no more than {} mm are filled; add the files",
        where, what, longest_mm, options.longest_fill_mm));
  }
  notes.push_back(fmt::format("{}: interpolated", what));
}

void CheckAside(std::span<const Vec3> positions, const std::vector<Level>& levels,
                const std::vector<int>& places, const SliceStack& stack,
                std::span<const std::string> names, const std::string& where) {
  const double allowed_mm = std::max(kLeastOff_mm, kOffShare * stack.step.norm());
  std::vector<std::string> aside;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const Vec3 expected = stack.origin + places[k] * stack.step;
    const double off = (positions[levels[k].slice] - expected).norm();
    if (off > allowed_mm) {
      aside.push_back(fmt::format("{} by {:.2f} mm", names[levels[k].slice], off));
    }
  }
  if (!aside.empty()) {
    throw InputError(
        fmt::format("{}: {} slices lie aside of the line of the first and last: {}; the table or "
                    "the field of view moved: choose a series of one scan",
                    where, aside.size(), Some(aside)));
  }
}

}  // namespace

SliceStack StackSlices(std::span<const Vec3> positions, const Vec3& normal,
                       std::span<const std::string> names, const StackOptions& options,
                       const std::string& where) {
  SliceStack stack;
  const std::vector<Level> levels =
      WithoutDoubles(SortedLevels(positions, normal), names, options, where, stack.notes);
  if (levels.size() < 2) {
    throw InputError(
        fmt::format("{}: {} slices are not a volume; it needs 2", where, levels.size()));
  }
  const std::vector<int> places = Places(levels, where);
  CheckGaps(levels, places, options, where, stack.notes);
  stack.origin = positions[levels.front().slice];
  stack.step = (positions[levels.back().slice] - stack.origin) / places.back();
  CheckAside(positions, levels, places, stack, names, where);
  stack.slices.assign(places.back() + 1, -1);
  for (std::size_t k = 0; k < levels.size(); ++k) {
    stack.slices[places[k]] = levels[k].slice;
  }
  return stack;
}

double TiltDeg(const SliceStack& stack, const Vec3& normal) {
  const double cosine = std::clamp(stack.step.normalized().dot(normal), -1.0, 1.0);
  return std::acos(cosine) * 180 / std::numbers::pi;
}

}  // namespace semblance
