// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/voxel_mask.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "surfaces/base/parallel.h"

namespace semblance::problems {
namespace {

const float kFar = std::numeric_limits<float>::infinity();

// Appends the runs of the line of `count` voxels that begins at `start`.
void AppendRuns(const VoxelMask& mask, std::int64_t start, int count, std::vector<VoxelRun>& runs) {
  const std::uint8_t* const begin = mask.data() + start;
  const std::uint8_t* const end = begin + count;
  for (const std::uint8_t* at = begin; at < end;) {
    const auto* first = static_cast<const std::uint8_t*>(std::memchr(at, 1, end - at));
    if (!first) {
      return;
    }
    const auto* past = static_cast<const std::uint8_t*>(std::memchr(first, 0, end - first));
    past = past ? past : end;
    runs.push_back({start + (first - begin), static_cast<std::int32_t>(past - first)});
    at = past;
  }
}

// Disjoint sets of connected runs (union-find); the representative of a set is its first run.
class RunSets {
 public:
  explicit RunSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }
  std::int32_t Find(std::int32_t run) {
    while (parent_[run] != run) {
      parent_[run] = parent_[parent_[run]];
      run = parent_[run];
    }
    return run;
  }
  void Join(std::int32_t a, std::int32_t b) {
    const std::int32_t first = Find(a), second = Find(b);
    parent_[std::max(first, second)] = std::min(first, second);
  }

 private:
  std::vector<std::int32_t> parent_;
};

// Joins touching runs of two neighbouring lines. `apart` is the difference of the lines' voxel
// indices.
void JoinLines(const std::vector<VoxelRun>& runs, const std::vector<std::int32_t>& line_start,
               std::int64_t line, std::int64_t other, std::int64_t apart, RunSets& sets) {
  std::int32_t a = line_start[line], b = line_start[other];
  while (a < line_start[line + 1] && b < line_start[other + 1]) {
    const std::int64_t a_past = runs[a].first + runs[a].length;
    const std::int64_t b_first = runs[b].first + apart, b_past = b_first + runs[b].length;
    if (runs[a].first < b_past && b_first < a_past) {
      sets.Join(a, b);
    }
    (a_past < b_past ? a : b) += 1;
  }
}

// Numbers the sets in the order of their first run, and counts their voxels.
void NumberComponents(RunSets& sets, VoxelComponents& components) {
  for (std::size_t r = 0; r < components.runs.size(); ++r) {
    VoxelRun& run = components.runs[r];
    const std::int32_t first = sets.Find(static_cast<std::int32_t>(r));
    if (first == static_cast<std::int32_t>(r)) {
      run.component = static_cast<std::int32_t>(components.sizes.size());
      components.sizes.push_back(0);
    } else {
      run.component = components.runs[first].component;
    }
    components.sizes[run.component] += run.length;
  }
}

using SquaredDistances = std::vector<float, LargePages<float>>;  // squared, one per voxel

// Parallel lines of floats; line r begins at first + r * stride, for r in [0, rows).
struct LineStack {
  std::int64_t first = 0, stride = 0;
  int rows = 0, columns = 0;
};

// Lowers each squared distance to the least one over all lines of the stack within reach. cost[n]
// is the squared distance of n lines.
void LowerOverLines(const LineStack& stack, const std::vector<float>& cost,
                    SquaredDistances& squared) {
  const int reach = static_cast<int>(cost.size()) - 1;
  std::vector<float> before(static_cast<std::size_t>(stack.rows) * stack.columns);
  std::vector<bool> any(stack.rows);
  for (int r = 0; r < stack.rows; ++r) {
    const float* const line = squared.data() + stack.first + r * stack.stride;
    std::copy(line, line + stack.columns,
              before.begin() + static_cast<std::ptrdiff_t>(r) * stack.columns);
    any[r] = std::any_of(line, line + stack.columns, [](float d) { return d < kFar; });
  }
  for (int r = 0; r < stack.rows; ++r) {
    float* const line = squared.data() + stack.first + r * stack.stride;
    for (int m = std::max(0, r - reach); m <= std::min(stack.rows - 1, r + reach); ++m) {
      if (!any[m] || m == r) {
        continue;
      }
      const float* const other = before.data() + static_cast<std::ptrdiff_t>(m) * stack.columns;
      const float more = cost[std::abs(m - r)];
      for (int i = 0; i < stack.columns; ++i) {
        const float over = other[i] + more;
        line[i] = over < line[i] ? over : line[i];
      }
    }
  }
}

// The squared distance of n steps for each n within reach.
std::vector<float> StepCosts(double spacing_mm, double reach_mm, int count) {
  const int steps = std::min(count - 1, static_cast<int>(reach_mm / spacing_mm));
  std::vector<float> cost;
  for (int n = 0; n <= steps; ++n) {
    cost.push_back(static_cast<float>(spacing_mm * spacing_mm * n * n));
  }
  return cost;
}

// The squared distances to the mask along one line of voxels: one sweep forward, one backward.
void DistancesInLine(const std::uint8_t* mask, int count, const std::vector<float>& cost,
                     float* squared) {
  const int reach = static_cast<int>(cost.size()) - 1;
  int steps = reach + 1;
  for (int i = 0; i < count; ++i) {
    steps = mask[i] ? 0 : std::min(steps + 1, reach + 1);
    squared[i] = kFar;
    if (steps <= reach) {
      squared[i] = cost[steps];
    }
  }
  steps = reach + 1;
  for (int i = count - 1; i >= 0; --i) {
    steps = mask[i] ? 0 : std::min(steps + 1, reach + 1);
    squared[i] = steps <= reach ? std::min(squared[i], cost[steps]) : squared[i];
  }
}

}  // namespace

int VoxelComponents::Largest() const {
  return sizes.empty()
             ? -1
             : static_cast<int>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
}

VoxelComponents LabelComponents(const VoxelMask& mask, const VoxelGrid& grid) {
  VoxelComponents components;
  const std::int64_t width = grid.counts[0], lines = std::int64_t{grid.counts[1]} * grid.counts[2];
  std::vector<std::int32_t> line_start = {0};
  for (std::int64_t line = 0; line < lines; ++line) {
    AppendRuns(mask, line * width, grid.counts[0], components.runs);
    line_start.push_back(static_cast<std::int32_t>(components.runs.size()));
  }
  RunSets sets(components.runs.size());
  for (std::int64_t line = 0; line < lines; ++line) {
    if (line % grid.counts[1] > 0) {
      JoinLines(components.runs, line_start, line, line - 1, width, sets);
    }
    if (line >= grid.counts[1]) {
      JoinLines(components.runs, line_start, line, line - grid.counts[1], width * grid.counts[1],
                sets);
    }
  }
  NumberComponents(sets, components);
  return components;
}

VoxelMask MakeMask(const VoxelComponents& components, const std::vector<bool>& keep,
                   const VoxelGrid& grid) {
  VoxelMask mask(static_cast<std::size_t>(grid.Count()), 0);
  for (const VoxelRun& run : components.runs) {
    if (keep[run.component]) {
      std::fill_n(mask.begin() + run.first, run.length, std::uint8_t{1});
    }
  }
  return mask;
}

VoxelMask Flood(const VoxelMask& allowed, const VoxelMask& starts, const VoxelGrid& grid) {
  const VoxelComponents components = LabelComponents(allowed, grid);
  std::vector<bool> reached(components.sizes.size(), false);
  for (const VoxelRun& run : components.runs) {
    if (!reached[run.component]) {
      reached[run.component] = std::memchr(starts.data() + run.first, 1,
                                           static_cast<std::size_t>(run.length)) != nullptr;
    }
  }
  return MakeMask(components, reached, grid);
}

// An exact distance transform, one axis after the other, because a squared distance is a sum over
// the axes. The reach is short, so each axis simply tries all lines within reach.
VoxelMask Dilate(const VoxelMask& mask, const VoxelGrid& grid, double distance_mm, int threads) {
  const auto [columns, rows, slices] = grid.counts;
  const std::int64_t row = columns, slice = row * rows;
  const auto cost = [&](int axis) {
    return StepCosts(grid.spacing_mm[axis], distance_mm, grid.counts[axis]);
  };
  const std::vector<float> along = cost(0), over_rows = cost(1), over_slices = cost(2);
  SquaredDistances squared(mask.size());
  ParallelFor(slices, threads, 1, [&, columns = columns, rows = rows](std::size_t k) {
    const std::int64_t first = static_cast<std::int64_t>(k) * slice;
    for (int j = 0; j < rows; ++j) {
      DistancesInLine(mask.data() + first + j * row, columns, along,
                      squared.data() + first + j * row);
    }
    LowerOverLines({first, row, rows, columns}, over_rows, squared);
  });
  ParallelFor(rows, threads, 1, [&, columns = columns, slices = slices](std::size_t j) {
    LowerOverLines({static_cast<std::int64_t>(j) * row, slice, slices, columns}, over_slices,
                   squared);
  });
  constexpr double kRoundOff = 1e-6;  // of squared distances as floats
  const auto limit = static_cast<float>(distance_mm * distance_mm * (1 + kRoundOff));
  VoxelMask grown(mask.size());
  std::transform(squared.begin(), squared.end(), grown.begin(),
                 [&](float d) { return static_cast<std::uint8_t>(d <= limit); });
  return grown;
}

}  // namespace semblance::problems
