// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/stencil_matrix.h"

#include <algorithm>

#include "surfaces/base/simd.h"

namespace semblance {
namespace {

// One diagonal of one row of vertices: x_near and y_near are those of the row itself, x_far and
// y_far those that the diagonal leads to.
struct DiagonalRow {
  const double* entries;
  const double* x_near;
  const double* x_far;
  double* y_near;
  double* y_far;
  int count;
};

SEMBLANCE_WIDE void AddMain(const DiagonalRow& row) {
  const double *const p = row.entries, *const x = row.x_near;
  double* const y = row.y_near;
  for (int i = 0; i < row.count; ++i) {
    y[i] += p[i] * x[i];
  }
}

// Two loops, for the two rows may be one and the same.
SEMBLANCE_WIDE void AddBoth(const DiagonalRow& row) {
  const double* const p = row.entries;
  const double *const near = row.x_near, *const far = row.x_far;
  double *const to_near = row.y_near, *const to_far = row.y_far;
  for (int i = 0; i < row.count; ++i) {
    to_near[i] += p[i] * far[i];
  }
  for (int i = 0; i < row.count; ++i) {
    to_far[i] += p[i] * near[i];
  }
}

}  // namespace

void StencilMatrix::AddPatch(int i, int j, const Matrix16& matrix) {
  const int columns = layout_.grid.Columns();
  for (int k = 0; k < 16; ++k) {
    const int a = k % 4, b = k / 4, column = (i + a) % columns;
    Filled& filled = filled_[j + b];
    filled = filled.end == 0
                 ? Filled{column, column + 1}
                 : Filled{std::min(filled.begin, column), std::max(filled.end, column + 1)};
    for (int l = k; l < 16; ++l) {
      const std::size_t start = RowStart(j + b, Slot(l % 4 - a, l / 4 - b));
      diagonals_[start + column] += matrix(k, l);
    }
  }
}

void StencilMatrix::AddProduct(const GridValues& x, GridValues& y) const {
  const int rows = layout_.grid.Rows();
  for (int j = 0; j < rows; ++j) {
    const auto [begin, end] = filled_[j];
    for (int c = 0; c < x.channels(); ++c) {
      for (int dj = 0; dj <= 3 && j + dj < rows; ++dj) {
        for (int di = dj == 0 ? 0 : -3; di <= 3; ++di) {
          const DiagonalRow row{.entries = diagonals_.data() + RowStart(j, Slot(di, dj)) + begin,
                                .x_near = x.Row(c, j) + begin,
                                .x_far = x.Row(c, j + dj) + begin + di,
                                .y_near = y.Row(c, j) + begin,
                                .y_far = y.Row(c, j + dj) + begin + di,
                                .count = end - begin};
          if (di == 0 && dj == 0) {
            AddMain(row);
          } else {
            AddBoth(row);
          }
        }
      }
    }
  }
}

}  // namespace semblance
