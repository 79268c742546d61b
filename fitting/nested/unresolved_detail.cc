// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/unresolved_detail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "fitting/nested/lanes.h"
#include "surfaces/base/simd.h"

namespace semblance::fitting {
namespace {

// Smallest statistic of detail: at 1 the gain of the functions equals their cost in variance.
constexpr double kMinEvidence = 1;
// Share of a patch's finer patches that must detect detail. Less follows noise, more misses detail
// in a part of the patch (chosen on the sets of docs/explanation/fit.md, "How good it is").
constexpr double kMinShare = 0.15;

// Per function of a level, by GridLayout::At: the square of the residuals' sum, and the sum of
// their squares.
struct Evidence {
  std::vector<double> together, apart;
};

// The fitted points and their residuals, in the order of the curve. The data of a point are stored
// together, because a sample is scattered over memory.
struct EvidencePoints {
  struct Place {
    double x, y, weight;  // in patches of level 0
  };
  int channels;
  std::vector<Place> places;
  std::span<const NestedResidual> residuals;
};

EvidencePoints MakeEvidencePoints(const NestedPoints& points,
                                  std::span<const std::uint32_t> indices,
                                  std::span<const NestedResidual> residuals) {
  EvidencePoints of{.channels = points.channels, .places = {}, .residuals = residuals};
  of.places.reserve(indices.size());
  for (const std::uint32_t k : indices) {
    of.places.push_back({points.X(k), points.Y(k), points.Weight(k)});
  }
  return of;
}

// Points begin .. end - 1, which lie in one patch, and the map from their places to the patch.
struct PatchOfPoints {
  std::size_t begin, end;
  double scale;
  int i, j;
};

// Adds the first four numbers to one row of a patch's vertices, and the other four to the next row.
SEMBLANCE_INLINE void AddTwoRows(const Wider& sums, double* row, double* next) {
  Wide some[2], there[2];
  std::memcpy(some, &sums, sizeof some);
  std::memcpy(&there[0], row, sizeof(Wide));
  std::memcpy(&there[1], next, sizeof(Wide));
  there[0] += some[0];
  there[1] += some[1];
  std::memcpy(row, &there[0], sizeof(Wide));
  std::memcpy(next, &there[1], sizeof(Wide));
}

// Adds a patch's points to its sixteen functions: w N e for each channel, and (w N)^2 |e|^2 as the
// last channel.
template <int channels>
SEMBLANCE_INLINE void SumPatch(const EvidencePoints& of, const PatchOfPoints& patch,
                               GridValues& values) {
  double u[4], v[4];
  Wider sums[channels + 1][2] = {};
  for (std::size_t n = patch.begin; n < patch.end; ++n) {
    const auto& [x, y, w] = of.places[n];
    WeightsAt(x * patch.scale - patch.i, u);
    WeightsAt(y * patch.scale - patch.j, v);
    const Wider along_u = w * Wider{u[0], u[1], u[2], u[3], u[0], u[1], u[2], u[3]};
    for (int half = 0; half < 2; ++half) {
      const double a = v[2 * half], b = v[2 * half + 1];
      const Wider both = along_u * Wider{a, a, a, a, b, b, b, b};
      double square = 0;
      for (int c = 0; c < channels; ++c) {
        const double e = of.residuals[n].along[c];
        square += e * e;
        sums[c][half] += both * e;
      }
      sums[channels][half] += both * both * square;
    }
  }
  for (int c = 0; c <= channels; ++c) {
    for (int half = 0; half < 2; ++half) {
      const int j = patch.j + 2 * half;
      AddTwoRows(sums[c][half], values.Row(c, j) + patch.i, values.Row(c, j + 1) + patch.i);
    }
  }
}

SEMBLANCE_WIDE void SumPatchOf1(const EvidencePoints& of, const PatchOfPoints& patch,
                                GridValues& values) {
  SumPatch<1>(of, patch, values);
}
SEMBLANCE_WIDE void SumPatchOf2(const EvidencePoints& of, const PatchOfPoints& patch,
                                GridValues& values) {
  SumPatch<2>(of, patch, values);
}
SEMBLANCE_WIDE void SumPatchOf3(const EvidencePoints& of, const PatchOfPoints& patch,
                                GridValues& values) {
  SumPatch<3>(of, patch, values);
}

// Adds the points of all patches (SumPatch).
void SumUp(const EvidencePoints& of, const GridLayout& layout, int level, GridValues& values) {
  constexpr void (*kSum[])(const EvidencePoints&, const PatchOfPoints&, GridValues&) = {
      SumPatchOf1, SumPatchOf2, SumPatchOf3};
  const auto patch_of = [&](std::size_t n) {
    return PatchOn(layout.grid, level, of.places[n].x, of.places[n].y);
  };
  for (std::size_t begin = 0, end = 0; begin < of.places.size(); begin = end) {
    const auto [i, j] = patch_of(begin);
    for (end = begin + 1; end < of.places.size() && patch_of(end) == std::array{i, j};) {
      ++end;
    }
    kSum[of.channels - 1](of, {begin, end, static_cast<double>(1 << level), i, j}, values);
  }
}

// Adds the values beyond the seam to the columns across it.
void FoldSeam(GridValues& values) {
  const PatchGrid& grid = values.layout().grid;
  for (int c = 0; grid.periodic_u && c < values.channels(); ++c) {
    for (int j = 0; j < grid.Rows(); ++j) {
      for (int k = 0; k < GridLayout::kHalo; ++k) {
        values.Row(c, j)[k % grid.Columns()] += values.Row(c, j)[grid.Columns() + k];
      }
    }
  }
}

Evidence ComputeEvidence(const EvidencePoints& of, const GridLayout& layout, int level) {
  const int channels = of.channels;
  GridValues values(layout, channels + 1);
  SumUp(of, layout, level, values);
  FoldSeam(values);
  Evidence evidence{std::vector<double>(layout.Size(), 0), {}};
  for (int c = 0; c < channels; ++c) {
    const double* const sum = values.Channel(c);
    for (std::size_t at = 0; at < layout.Size(); ++at) {
      evidence.together[at] += sum[at] * sum[at];
    }
  }
  evidence.apart.assign(values.Channel(channels), values.Channel(channels) + layout.Size());
  return evidence;
}

// Adds to each patch i of the coarser level the five columns of a row from 2 i on.
void AddWindows(const GridLayout& layout, const std::vector<double>& values, int row,
                std::vector<double>& sums) {
  const int columns = layout.grid.Columns();
  const double* const of_row = values.data() + layout.At(0, row);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const int first = 2 * static_cast<int>(i);
    for (int a = first; a <= first + 4; ++a) {
      if (a < columns) {
        sums[i] += of_row[a];
      } else if (layout.grid.periodic_u) {
        sums[i] += of_row[a - columns];
      }
    }
  }
}

// Tests the functions of a level over each patch of the next coarser level.
std::vector<char> DetectPatches(const GridLayout& layout, const GridLayout& coarser,
                                const Evidence& evidence) {
  const PatchGrid& grid = coarser.grid;
  std::vector<char> seen(coarser.Patches(), 0);
  std::vector<double> together(grid.patches_u), apart(grid.patches_u);
  for (int j = 0; j < grid.patches_v; ++j) {
    std::fill(together.begin(), together.end(), 0.0);
    std::fill(apart.begin(), apart.end(), 0.0);
    for (int b = 2 * j; b <= 2 * j + 4; ++b) {
      const int row = WrapIndex(layout.grid.Rows(), b, false);
      if (row >= 0) {
        AddWindows(layout, evidence.together, row, together);
        AddWindows(layout, evidence.apart, row, apart);
      }
    }
    for (int i = 0; i < grid.patches_u; ++i) {
      seen[coarser.Patch(i, j)] = apart[i] > 0 && together[i] / apart[i] - 1 > kMinEvidence ? 1 : 0;
    }
  }
  return seen;
}

// Returns whether the functions of level `finer` detect detail over a large enough share of a patch
// of `level`.
bool IsDetected(const UnresolvedDetail& detail, int finer, const GridLayout& layout, int level,
                int i, int j) {
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
  return count > kMinShare * side * side || (shift == 0 && count > 0);
}

}  // namespace

UnresolvedDetail FindUnresolvedDetail(const NestedPoints& points, const NestedSpace& space,
                                      int finest, std::span<const std::uint32_t> indices,
                                      std::span<const NestedResidual> residuals) {
  UnresolvedDetail detail{.seen = {}, .first = space.FinestWhole() + 1};
  detail.seen.resize(1);
  const EvidencePoints of = MakeEvidencePoints(points, indices, residuals);
  GridLayout coarser = space[0].layout;
  for (int level = 1; level <= finest; ++level) {
    const GridLayout layout = coarser.Finer();
    detail.seen.emplace_back();
    if (level >= detail.first) {
      const Evidence evidence = ComputeEvidence(of, layout, level);
      detail.seen.back() = DetectPatches(layout, coarser, evidence);
    }
    coarser = layout;
  }
  return detail;
}

int OverlayDetail(const UnresolvedDetail& detail, NestedSpace& space) {
  int added = 0;
  const int finest = std::min(space.finest(), detail.Finest() - 1);
  for (int level = detail.first - 1; level <= finest; ++level) {
    const GridLayout layout = space[level].layout;
    for (int j = 0; j < layout.grid.patches_v; ++j) {
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        bool wanted = false;
        for (int finer = level + 1; !wanted && finer <= detail.Finest(); ++finer) {
          wanted = IsDetected(detail, finer, layout, level, i, j);
        }
        if (wanted && space[level].present[layout.Patch(i, j)] != 0) {
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
    const auto [i, j] = PatchOn(layout.grid, level, points.X(k), points.Y(k));
    ++counts[layout.Patch(i, j)];
  }
  int added = 0;
  for (int j = 0; j < layout.grid.patches_v; ++j) {
    for (int i = 0; i < layout.grid.patches_u; ++i) {
      const std::size_t patch = layout.Patch(i, j);
      if (space[level].present[patch] != 0 && counts[patch] >= 4 * points_per_patch) {
        added += space.Overlay(level, i, j);
      }
    }
  }
  space.Link();
  return added;
}

}  // namespace semblance::fitting
