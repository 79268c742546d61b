// SPDX-License-Identifier: GPL-3.0-or-later
// The normal matrix of one level: each vertex meets those up to three columns and rows away.
#pragma once

#include <vector>

#include "fitting/nested/grid_values.h"

namespace semblance {

// Symmetric; kept by its 25 diagonals on and above the main one, so that a product runs along the
// rows of the grid.
class StencilMatrix {
 public:
  StencilMatrix() = default;
  explicit StencilMatrix(const GridLayout& layout)
      : layout_(layout),
        diagonals_(layout.Size() * kDiagonals, 0.0),
        filled_(layout.grid.Rows(), Filled{}) {}

  bool empty() const { return diagonals_.empty(); }
  // Adds a patch's matrix over its sixteen vertices [a + 4 b]; its upper triangle is read.
  void AddPatch(int i, int j, const Matrix16& matrix);
  // y += A x. The halo of x must be filled; y gathers in its halo too.
  void AddProduct(const GridValues& x, GridValues& y) const;

 private:
  static constexpr int kDiagonals = 25;
  // The columns of a row outside of which all is zero.
  struct Filled {
    int begin = 0, end = 0;
  };
  // Of the vertex `di` columns and `dj` rows on: dj = 0 and di = 0..3, or dj = 1..3 and di = -3..3.
  static constexpr int Slot(int di, int dj) { return dj == 0 ? di : 4 + 7 * (dj - 1) + di + 3; }
  std::size_t RowStart(int j, int slot) const {
    return (static_cast<std::size_t>(j) * kDiagonals + slot) * layout_.Stride() + GridLayout::kHalo;
  }

  GridLayout layout_;
  std::vector<double> diagonals_;  // of a row of vertices all 25, one after the other
  std::vector<Filled> filled_;     // per row
};

}  // namespace semblance
