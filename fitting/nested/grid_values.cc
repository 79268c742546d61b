// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/grid_values.h"

#include <algorithm>

namespace semblance {
namespace {

// A vertex of the finer level that is odd lies on one of the coarser level and takes 1/8 6/8 1/8,
// an even one lies between two (RefineRow).
constexpr double kBeside = 0.125, kOn = 0.75, kBetween = 0.5;

// The columns of the finer level over the rows of the coarser one.
using HalfRefined = std::vector<double>;

int Wrapped(int i, int columns) { return ((i % columns) + columns) % columns; }

void RefineRowOf(const double* coarse, int columns, double* fine) {
  for (int i = 0; i < columns; ++i) {
    const double* const c = coarse + (i + 1) / 2;
    fine[i] = i % 2 != 0 ? kBeside * (c[-1] + c[1]) + kOn * c[0] : kBetween * (c[0] + c[1]);
  }
}

void RestrictRowOf(const double* fine, int columns, double* coarse) {
  for (int i = 0; i < columns; ++i) {
    double* const c = coarse + (i + 1) / 2;
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

}  // namespace

void GridValues::FillHalo() {
  if (!layout_.grid.periodic_u) {
    return;
  }
  const int columns = layout_.grid.Columns();
  for (int c = 0; c < channels_; ++c) {
    for (int j = 0; j < layout_.grid.Rows(); ++j) {
      double* const row = Row(c, j);
      for (int k = 1; k <= GridLayout::kHalo; ++k) {
        row[-k] = row[Wrapped(-k, columns)];
        row[columns - 1 + k] = row[Wrapped(k - 1, columns)];
      }
    }
  }
}

void GridValues::FoldHalo() {
  const int columns = layout_.grid.Columns();
  for (int c = 0; c < channels_; ++c) {
    for (int j = 0; j < layout_.grid.Rows(); ++j) {
      double* const row = Row(c, j);
      for (int k = 1; k <= GridLayout::kHalo; ++k) {
        if (layout_.grid.periodic_u) {
          row[Wrapped(-k, columns)] += row[-k];
          row[Wrapped(k - 1, columns)] += row[columns - 1 + k];
        }
        row[-k] = row[columns - 1 + k] = 0;
      }
    }
  }
}

void AddRefined(const GridValues& coarser, GridValues& finer) {
  const PatchGrid &from = coarser.layout().grid, &to = finer.layout().grid;
  const int columns = to.Columns();
  HalfRefined half(static_cast<std::size_t>(from.Rows()) * columns);
  const auto row_of = [&](int j) { return half.data() + static_cast<std::size_t>(j) * columns; };
  for (int c = 0; c < coarser.channels(); ++c) {
    for (int j = 0; j < from.Rows(); ++j) {
      RefineRowOf(coarser.Row(c, j), columns, row_of(j));
    }
    for (int j = 0; j < to.Rows(); ++j) {
      double* const out = finer.Row(c, j);
      const double* const on = row_of((j + 1) / 2);
      for (int i = 0; i < columns; ++i) {
        out[i] += j % 2 != 0 ? kBeside * (on[i - columns] + on[i + columns]) + kOn * on[i]
                             : kBetween * (on[i] + on[i + columns]);
      }
    }
  }
}

void AddRestricted(const GridValues& finer, GridValues& coarser) {
  const PatchGrid &from = finer.layout().grid, &to = coarser.layout().grid;
  const int columns = from.Columns();
  HalfRefined half(static_cast<std::size_t>(to.Rows()) * columns);
  const auto row_of = [&](int j) { return half.data() + static_cast<std::size_t>(j) * columns; };
  for (int c = 0; c < coarser.channels(); ++c) {
    std::fill(half.begin(), half.end(), 0.0);
    for (int j = 0; j < from.Rows(); ++j) {
      const double* const in = finer.Row(c, j);
      double* const on = row_of((j + 1) / 2);
      for (int i = 0; i < columns; ++i) {
        if (j % 2 != 0) {
          on[i - columns] += kBeside * in[i];
          on[i] += kOn * in[i];
          on[i + columns] += kBeside * in[i];
        } else {
          on[i] += kBetween * in[i];
          on[i + columns] += kBetween * in[i];
        }
      }
    }
    for (int j = 0; j < to.Rows(); ++j) {
      RestrictRowOf(row_of(j), columns, coarser.Row(c, j));
    }
  }
  coarser.FoldHalo();
}

}  // namespace semblance
