// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/unresolved_detail.h"

#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

// What the functions over a patch must show.
constexpr double kWorthIt = 1;
// Of the patches of a much finer level over a patch, how many must show something.
constexpr double kShare = 0.15;

// Per function of a level: the square of what the residuals sum to, and the sum of their squares.
struct Evidence {
  std::vector<double> together, apart;
};

Evidence EvidenceOn(const NestedPoints& points, const GridLayout& layout, int level,
                    std::span<const std::uint32_t> indices,
                    std::span<const NestedSolve::Residual> residuals) {
  const int columns = layout.grid.Columns();
  std::vector<std::array<double, 3>> sums(layout.Size(), {0, 0, 0});
  Evidence evidence{std::vector<double>(layout.Size(), 0), std::vector<double>(layout.Size(), 0)};
  for (std::size_t n = 0; n < indices.size(); ++n) {
    const std::uint32_t k = indices[n];
    const NestedPlace place = PlaceOn(layout.grid, level, points.x[k], points.y[k]);
    const double weight = points.weight[k], square = weight * weight * residuals[n].Square();
    for (int m = 0; m < 16; ++m) {
      const std::size_t at = layout.At((place.i + m % 4) % columns, place.j + m / 4);
      const double value = place.along_u[m % 4] * place.along_v[m / 4];
      for (int c = 0; c < points.channels; ++c) {
        sums[at][c] += weight * value * residuals[n].along[c];
      }
      evidence.apart[at] += value * value * square;
    }
  }
  for (std::size_t at = 0; at < sums.size(); ++at) {
    const auto& s = sums[at];
    evidence.together[at] = s[0] * s[0] + s[1] * s[1] + s[2] * s[2];
  }
  return evidence;
}

// Of the functions of a level over patch (i, j) of the level before.
double Excess(const GridLayout& layout, const Evidence& evidence, int i, int j) {
  const int columns = layout.grid.Columns(), rows = layout.grid.Rows();
  double together = 0, apart = 0;
  for (int b = 2 * j; b <= std::min(2 * j + 4, rows - 1); ++b) {
    for (int a = 2 * i; a <= 2 * i + 4; ++a) {
      if (layout.grid.periodic_u || a < columns) {
        together += evidence.together[layout.At(a % columns, b)];
        apart += evidence.apart[layout.At(a % columns, b)];
      }
    }
  }
  return apart > 0 ? together / apart - 1 : 0;
}

std::vector<char> PatchesSeen(const GridLayout& layout, const GridLayout& coarser,
                              const Evidence& evidence) {
  const PatchGrid& grid = coarser.grid;
  std::vector<char> seen(coarser.Patches(), 0);
  for (int j = 0; j < grid.patches_v; ++j) {
    for (int i = 0; i < grid.patches_u; ++i) {
      seen[coarser.Patch(i, j)] = Excess(layout, evidence, i, j) > kWorthIt ? 1 : 0;
    }
  }
  return seen;
}

// Whether the functions of a level see something over a patch of `level`, by enough of its parts.
bool SeenBy(const UnresolvedDetail& detail, int finer, const GridLayout& layout, int level, int i,
            int j) {
  const int shift = finer - 1 - level, side = 1 << shift;
  const std::size_t columns = static_cast<std::size_t>(layout.grid.patches_u) << shift;
  int count = 0;
  for (int b = 0; b < side; ++b) {
    const std::size_t row = (static_cast<std::size_t>(j) << shift) + b;
    const auto first =
        detail.seen[finer].begin() +
        static_cast<std::ptrdiff_t>(row * columns + (static_cast<std::size_t>(i) << shift));
    count += static_cast<int>(std::count(first, first + side, 1));
  }
  return count > kShare * side * side || (shift == 0 && count > 0);
}

}  // namespace

UnresolvedDetail FindUnresolvedDetail(const NestedPoints& points, const GridLayout& level0,
                                      int finest, std::span<const std::uint32_t> indices,
                                      std::span<const NestedSolve::Residual> residuals) {
  UnresolvedDetail detail;
  detail.seen.resize(1);
  GridLayout coarser = level0;
  for (int level = 1; level <= finest; ++level) {
    const GridLayout layout = coarser.Finer();
    const Evidence evidence = EvidenceOn(points, layout, level, indices, residuals);
    detail.seen.push_back(PatchesSeen(layout, coarser, evidence));
    coarser = layout;
  }
  return detail;
}

int OverlayDetail(const UnresolvedDetail& detail, NestedSpace& space) {
  int added = 0;
  const int finest = std::min(space.finest(), detail.Finest() - 1);
  for (int level = 0; level <= finest; ++level) {
    const GridLayout layout = space[level].layout;
    for (int j = 0; j < layout.grid.patches_v; ++j) {
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        bool wanted = false;
        for (int finer = level + 1; !wanted && finer <= detail.Finest(); ++finer) {
          wanted = SeenBy(detail, finer, layout, level, i, j);
        }
        if (wanted && space[level].there[layout.Patch(i, j)] != 0) {
          added += space.Overlay(level, i, j);
        }
      }
    }
  }
  space.Link();
  return added;
}

int OverlayDense(const NestedPoints& points, int level, double points_per_patch,
                 NestedSpace& space) {
  const GridLayout layout = space[level].layout;
  std::vector<int> counts(layout.Patches(), 0);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const NestedPlace place = PlaceOn(layout.grid, level, points.x[k], points.y[k]);
    ++counts[layout.Patch(place.i, place.j)];
  }
  int added = 0;
  for (int j = 0; j < layout.grid.patches_v; ++j) {
    for (int i = 0; i < layout.grid.patches_u; ++i) {
      const std::size_t patch = layout.Patch(i, j);
      if (space[level].there[patch] != 0 && counts[patch] >= 4 * points_per_patch) {
        added += space.Overlay(level, i, j);
      }
    }
  }
  space.Link();
  return added;
}

}  // namespace semblance
