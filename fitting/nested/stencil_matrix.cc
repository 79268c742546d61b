// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/stencil_matrix.h"

#include <algorithm>
#include <utility>

#include "fitting/nested/lanes.h"

namespace semblance::fitting {
namespace {

constexpr int kBlock = GridLayout::kBlock;

SEMBLANCE_INLINE void AddEight(const Wider& n, double* to) { PutEight(EightAt(to) + n, to); }

// A run's diagonals, and the channels' values from its first vertex on.
struct RunProduct {
  const double* entries;  // first diagonal's entry at the first vertex
  std::ptrdiff_t length;  // from diagonal to diagonal
  std::ptrdiff_t stride;  // from row to row
  int blocks;
  const double* x[4];
  double* y[4];
};

// Adds the products of a vertex with itself and the vertices ahead.
template <int channels>
SEMBLANCE_INLINE void AddNear(const RunProduct& run, std::ptrdiff_t k) {
  Wider sum[channels] = {};
  const double* entries = run.entries + k;
  for (std::ptrdiff_t dj = 0; dj <= 3; ++dj) {
    for (std::ptrdiff_t di = dj == 0 ? 0 : -3; di <= 3; ++di, entries += run.length) {
      const Wider entry = EightAt(entries);
      for (int c = 0; c < channels; ++c) {
        sum[c] += entry * EightAt(run.x[c] + k + dj * run.stride + di);
      }
    }
  }
  for (int c = 0; c < channels; ++c) {
    AddEight(sum[c], run.y[c] + k);
  }
}

// Adds the transposed products: contributions of the run's vertices to those dj rows ahead.
template <int channels>
SEMBLANCE_INLINE void AddFar(const RunProduct& run, std::ptrdiff_t dj, std::ptrdiff_t k) {
  Wider sum[channels] = {};
  const std::ptrdiff_t from = dj == 0 ? 1 : -3;
  const double* entries = run.entries + (dj == 0 ? 1 : 7 * dj - 3) * run.length + k - from;
  for (std::ptrdiff_t di = from; di <= 3; ++di, entries += run.length - 1) {
    const Wider entry = EightAt(entries);
    for (int c = 0; c < channels; ++c) {
      sum[c] += entry * EightAt(run.x[c] + k - di);
    }
  }
  for (int c = 0; c < channels; ++c) {
    AddEight(sum[c], run.y[c] + k + dj * run.stride);
  }
}

// Goes along the run once, so that each block's entries are read from memory once.
template <int channels>
SEMBLANCE_INLINE void AddRun(const RunProduct& run) {
  for (int block = 0; block <= run.blocks; ++block) {
    const std::ptrdiff_t k = static_cast<std::ptrdiff_t>(kBlock) * block;
    if (block < run.blocks) {
      AddNear<channels>(run, k);
    }
    for (std::ptrdiff_t dj = 0; dj <= 3; ++dj) {
      AddFar<channels>(run, dj, k - (dj == 0 ? 0 : 3));
    }
  }
}

SEMBLANCE_WIDE void AddRunOf1(const RunProduct& run) { AddRun<1>(run); }
SEMBLANCE_WIDE void AddRunOf2(const RunProduct& run) { AddRun<2>(run); }
SEMBLANCE_WIDE void AddRunOf3(const RunProduct& run) { AddRun<3>(run); }
SEMBLANCE_WIDE void AddRunOf4(const RunProduct& run) { AddRun<4>(run); }

using AddRunOf = void (*)(const RunProduct&);
AddRunOf AddRunFor(int channels) {
  constexpr AddRunOf kAll[] = {AddRunOf1, AddRunOf2, AddRunOf3, AddRunOf4};
  return kAll[channels - 1];
}

SEMBLANCE_WIDE void AddToAll(double value, int count, double* numbers) {
  for (int k = 0; k < count; ++k) {
    numbers[k] += value;
  }
}

}  // namespace

StencilMatrix::StencilMatrix(const GridLayout& layout, GridRuns runs)
    : layout_(layout), runs_(std::move(runs)) {
  std::size_t count = 0;
  for (const GridRun& run : runs_) {
    while (first_.size() <= static_cast<std::size_t>(run.row)) {
      first_.push_back(starts_.size());
    }
    starts_.push_back(count);
    count += kDiagonals * Length(run);
  }
  first_.resize(layout.grid.Rows() + 1, starts_.size());
  entries_.assign(count, 0.0);
}

// The last run of the row that begins at or before the column.
std::size_t StencilMatrix::RunWith(int row, int column) const {
  const auto begin = runs_.begin() + static_cast<std::ptrdiff_t>(first_[row]),
             end = runs_.begin() + static_cast<std::ptrdiff_t>(first_[row + 1]);
  const auto behind =
      std::partition_point(begin, end, [&](const GridRun& run) { return run.begin <= column; });
  return static_cast<std::size_t>(behind - runs_.begin()) - 1;
}

void StencilMatrix::AddPatch(int i, int j, const Matrix16& matrix) {
  const int columns = layout_.grid.Columns(), rows = layout_.grid.Rows();
  for (int b = 0; b < 4; ++b) {
    const int row = j + b < rows ? j + b : j + b - rows;
    std::size_t run = RunWith(row, i);
    for (int a = 0; a < 4; ++a) {
      const int column = (i + a) % columns, k = a + 4 * b;
      run = a > 0 && column == 0 ? RunWith(row, column) : run;
      const std::size_t length = Length(runs_[run]);
      double* const entries = entries_.data() + starts_[run] + kBefore + column - runs_[run].begin;
      for (int l = k; l < 16; ++l) {
        entries[Slot(l % 4 - a, l / 4 - b) * length] += matrix(k, l);
      }
    }
  }
}

// Adds a value to one diagonal's entries at `count` adjacent vertices of one run.
void StencilMatrix::AddAlong(int row, int column, int count, int slot, double value) {
  const std::size_t run = RunWith(row, column);
  double* const entries = entries_.data() + starts_[run] + kBefore + column - runs_[run].begin +
                          static_cast<std::size_t>(slot) * Length(runs_[run]);
  AddToAll(value, count, entries);
}

// Visits the vertices of the patches from the last to the first, so that each entry adds the
// patches in the order of AddPatch.
void StencilMatrix::AddPatches(int i, int j, int count, const Matrix16& matrix) {
  const int columns = layout_.grid.Columns(), rows = layout_.grid.Rows();
  for (int b = 0; b < 4; ++b) {
    const int row = j + b < rows ? j + b : j + b - rows;
    for (int a = 3; a >= 0; --a) {
      const int before_seam = std::clamp(columns - (i + a), 0, count);
      const int k = a + 4 * b;
      for (int l = k; l < 16; ++l) {
        const int slot = Slot(l % 4 - a, l / 4 - b);
        if (before_seam > 0) {
          AddAlong(row, i + a, before_seam, slot, matrix(k, l));
        }
        if (before_seam < count) {
          AddAlong(row, (i + a + before_seam) % columns, count - before_seam, slot, matrix(k, l));
        }
      }
    }
  }
}

void StencilMatrix::AddProduct(const GridValues& x, GridValues& y) const {
  const AddRunOf add = AddRunFor(x.channels());
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    RunProduct product{.entries = entries_.data() + starts_[r] + kBefore,
                       .length = static_cast<std::ptrdiff_t>(Length(runs_[r])),
                       .stride = static_cast<std::ptrdiff_t>(layout_.Stride()),
                       .blocks = runs_[r].blocks,
                       .x = {},
                       .y = {}};
    for (int c = 0; c < x.channels(); ++c) {
      product.x[c] = x.Channel(c) + runs_[r].at;
      product.y[c] = y.Channel(c) + runs_[r].at;
    }
    add(product);
  }
}

}  // namespace semblance::fitting
