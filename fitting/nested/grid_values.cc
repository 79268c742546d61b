// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/grid_values.h"

#include <algorithm>
#include <new>

#include "fitting/nested/lanes.h"
#include "surfaces/base/simd.h"

namespace semblance::fitting {
namespace {

// Knot insertion (RefineRow): an odd vertex of the finer level lies on a coarser vertex, with
// weights 1/8 6/8 1/8; an even one lies between two, with weights 1/2 1/2.
constexpr double kBeside = 0.125, kOn = 0.75, kBetween = 0.5;

int Wrapped(int i, int columns) { return ((i % columns) + columns) % columns; }

// The rows of the coarser level around a row of the finer level, which lies on or between them.
struct CoarseRows {
  const double* coarse;  // column 0 of row (j + 1) / 2
  std::ptrdiff_t stride;
  bool on;
};

SEMBLANCE_WIDE void CombineRows(const CoarseRows& way, int first, int count, double* across) {
  const double *const c = way.coarse + first, *const before = c - way.stride,
                      *const after = c + way.stride;
  if (way.on) {
    for (int k = 0; k < count; ++k) {
      across[k] = kBeside * (before[k] + after[k]) + kOn * c[k];
    }
  } else {
    for (int k = 0; k < count; ++k) {
      across[k] = kBetween * (c[k] + after[k]);
    }
  }
}

// across: values from coarse column 0 on. Odd fine columns lie on a coarse column, even ones
// between two.
SEMBLANCE_WIDE void RefineAlong(const double* across, int begin, int end, double* fine) {
  const int odd = begin / 2, even = (begin + 1) / 2;  // 2 k + 1, 2 k
  for (int k = odd; 2 * k + 1 < end; ++k) {
    fine[2 * k + 1] += kBeside * (across[k] + across[k + 2]) + kOn * across[k + 1];
  }
  for (int k = even; 2 * k < end; ++k) {
    fine[2 * k] += kBetween * (across[k] + across[k + 1]);
  }
}

SEMBLANCE_WIDE void RestrictAlong(const double* fine, int begin, int end, double* across) {
  for (int i = begin; i < end; ++i) {
    double* const c = across + (i + 1) / 2;
    if (i % 2 != 0) {
      c[-1] += kBeside * fine[i];
      c[0] += kOn * fine[i];
      c[1] += kBeside * fine[i];
    } else {
      c[0] += kBetween * fine[i];
      c[1] += kBetween * fine[i];
    }
  }
}

SEMBLANCE_WIDE void SpreadRow(const double* across, int count, bool on, std::ptrdiff_t stride,
                              double* coarse) {
  double *const before = coarse - stride, *const after = coarse + stride;
  if (on) {
    for (int k = 0; k < count; ++k) {
      before[k] += kBeside * across[k];
      coarse[k] += kOn * across[k];
      after[k] += kBeside * across[k];
    }
  } else {
    for (int k = 0; k < count; ++k) {
      coarse[k] += kBetween * across[k];
      after[k] += kBetween * across[k];
    }
  }
}

// The columns of a run of the finer level, without those of the last block beyond the row.
struct Columns {
  int begin, end;
  int FirstCoarse() const { return (begin + 1) / 2 - (begin % 2 != 0 ? 1 : 0); }
  int LastCoarse() const { return end / 2 + 1; }
};

Columns RunColumns(const GridRun& run, const GridLayout& layout) {
  return {run.begin, std::min(run.begin + run.size(), layout.grid.Columns())};
}

}  // namespace

std::array<int, 4> PatchRowsAround(const PatchGrid& grid, int row) {
  std::array<int, 4> rows;
  for (int b = 0; b < 4; ++b) {
    rows[b] = WrapIndex(grid.patches_v, row - 3 + b, false);
  }
  return rows;
}

GridRuns RunsAround(const GridLayout& layout, const std::vector<char>& patches) {
  const int columns = layout.grid.Columns();
  GridRuns runs;
  std::vector<char> wanted(columns);
  for (int row = 0; row < layout.grid.Rows(); ++row) {
    std::fill(wanted.begin(), wanted.end(), 0);
    for (const int j : PatchRowsAround(layout.grid, row)) {
      if (j < 0) {
        continue;
      }
      const char* const there = patches.data() + layout.Patch(0, j);
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        for (int a = 0; there[i] != 0 && a < 4; ++a) {
          wanted[(i + a) % columns] = 1;
        }
      }
    }
    for (int i = 0; i < columns; ++i) {
      if (wanted[i] == 0) {
        continue;
      }
      const bool joins =
          !runs.empty() && runs.back().row == row && i < runs.back().begin + runs.back().size();
      const bool follows =
          !runs.empty() && runs.back().row == row && i == runs.back().begin + runs.back().size();
      if (follows) {
        ++runs.back().blocks;
      } else if (!joins) {
        runs.push_back({.at = layout.At(i, row), .row = row, .begin = i, .blocks = 1});
      }
    }
  }
  return runs;
}

GridValues::GridValues(const GridLayout& layout, int channels)
    : layout_(layout), channels_(channels) {
  const std::size_t count = Start(channels) + GridLayout::kHalo * layout_.Stride();
  values_.reset(static_cast<double*>(std::calloc(count, sizeof(double))));
  if (!values_) {
    throw std::bad_alloc();
  }
}

void GridValues::Clear(const GridRuns& runs) {
  for (int c = 0; c < channels_; ++c) {
    for (const GridRun& run : runs) {
      std::fill_n(Channel(c) + run.at, run.size(), 0.0);
    }
  }
}

void GridValues::FillRow(double* row) const {
  const int columns = layout_.grid.Columns();
  for (int k = 1; k <= GridLayout::kHalo; ++k) {
    row[-k] = row[Wrapped(-k, columns)];
    row[columns - 1 + k] = row[Wrapped(k - 1, columns)];
  }
}

void GridValues::FoldRow(double* row) const {
  const int columns = layout_.grid.Columns();
  for (int k = 1; k <= GridLayout::kHalo; ++k) {
    if (layout_.grid.periodic_u) {
      row[Wrapped(-k, columns)] += row[-k];
      row[Wrapped(k - 1, columns)] += row[columns - 1 + k];
    }
    row[-k] = row[columns - 1 + k] = 0;
  }
}

void GridValues::FillHalo(const GridRuns& runs) {
  for (int c = 0; layout_.grid.periodic_u && c < channels_; ++c) {
    int done = -1;
    for (const GridRun& run : runs) {
      if (run.row != done) {
        FillRow(Row(c, run.row));
        done = run.row;
      }
    }
  }
}

void GridValues::FoldHalo(const GridRuns& runs) {
  const int last = layout_.grid.Rows() - 1;
  for (int c = 0; c < channels_; ++c) {
    int next = 0;
    for (const GridRun& run : runs) {
      for (next = std::max(next, run.row); next <= std::min(run.row + 3, last); ++next) {
        FoldRow(Row(c, next));
      }
    }
  }
}

void AddRefined(const GridValues& coarser, const GridRuns& runs, GridValues& finer) {
  std::vector<double> across(coarser.layout().Stride() + 2);
  for (int c = 0; c < coarser.channels(); ++c) {
    for (const GridRun& run : runs) {
      const Columns columns = RunColumns(run, finer.layout());
      const int first = columns.FirstCoarse(), count = columns.LastCoarse() - first + 1;
      CombineRows({.coarse = coarser.Row(c, (run.row + 1) / 2),
                   .stride = static_cast<std::ptrdiff_t>(coarser.layout().Stride()),
                   .on = run.row % 2 != 0},
                  first, count, across.data() + first);
      RefineAlong(across.data(), columns.begin, columns.end, finer.Row(c, run.row));
    }
  }
}

void AddRestricted(const GridValues& finer, const GridRuns& runs, GridValues& coarser) {
  std::vector<double> across(coarser.layout().Stride() + 2);
  for (int c = 0; c < coarser.channels(); ++c) {
    for (const GridRun& run : runs) {
      const Columns columns = RunColumns(run, finer.layout());
      const int first = columns.FirstCoarse(), count = columns.LastCoarse() - first + 1;
      std::fill_n(across.begin() + first, count, 0.0);
      RestrictAlong(finer.Row(c, run.row), columns.begin, columns.end, across.data());
      SpreadRow(across.data() + first, count, run.row % 2 != 0,
                static_cast<std::ptrdiff_t>(coarser.layout().Stride()),
                coarser.Row(c, (run.row + 1) / 2) + first);
    }
  }
}

namespace {

// Calls body(k) for each block of eight places from k on.
template <class Body>
SEMBLANCE_INLINE void ForEachBlock(const GridRuns& runs, const Body& body) {
  for (const GridRun& run : runs) {
    for (int block = 0; block < run.blocks; ++block) {
      body(run.at + static_cast<std::size_t>(GridLayout::kBlock) * block);
    }
  }
}

}  // namespace

SEMBLANCE_WIDE double DotOn(const GridRuns& runs, const double* a, const double* b) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k)
                __attribute__((always_inline)) { sum += EightAt(a + k) * EightAt(b + k); });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE double SquaresOn(const GridRuns& runs, const double* inverse,
                                const double* residual) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        const Wider r = EightAt(residual + k);
        sum += EightAt(inverse + k) * r * r;
      });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE void CopyOn(const GridRuns& runs, const double* from, double* to) {
  ForEachBlock(
      runs, [&](std::size_t k)
                __attribute__((always_inline)) { PutEight(EightAt(from + k), to + k); });
}

void InvertOn(const GridRuns& runs, const double* data, const double* energy, double factor,
              const char* active, double* inverse) {
  for (const GridRun& run : runs) {
    for (std::size_t k = run.at; k < run.at + run.size(); ++k) {
      const double diagonal = data[k] + factor * energy[k];
      inverse[k] = active[k] != 0 && diagonal > 0 ? 1 / diagonal : 0;
    }
  }
}

SEMBLANCE_WIDE double SubtractOn(const GridRuns& runs, const double* inverse, const double* product,
                                 double* residual) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        const Wider r = EightAt(residual + k) - EightAt(product + k);
        PutEight(r, residual + k);
        sum += EightAt(inverse + k) * r * r;
      });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE double AdvanceOn(const GridRuns& runs, const GridStep& step, double length) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        const Wider r = EightAt(step.residual + k) - length * EightAt(step.product + k);
        PutEight(EightAt(step.solution + k) + length * EightAt(step.direction + k),
                 step.solution + k);
        PutEight(r, step.residual + k);
        sum += EightAt(step.inverse + k) * r * r;
      });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE void TurnOn(const GridRuns& runs, const GridStep& step, double factor) {
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        PutEight(EightAt(step.inverse + k) * EightAt(step.residual + k) +
                     factor * EightAt(step.direction + k),
                 step.direction + k);
      });
}

}  // namespace semblance::fitting
