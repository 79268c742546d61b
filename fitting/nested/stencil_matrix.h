// SPDX-License-Identifier: GPL-3.0-or-later
// The normal matrix of one level: each vertex meets those up to three columns and rows away.
#pragma once

#include <span>
#include <vector>

#include "fitting/nested/grid_values.h"

namespace semblance {

// Symmetric; kept by its 25 diagonals on and above the main one, of each run of vertices by itself,
// so that a product goes along the rows of the grid.
class StencilMatrix {
 public:
  StencilMatrix() = default;
  // runs: all vertices of the patches that will be added.
  StencilMatrix(const GridLayout& layout, GridRuns runs);

  bool empty() const { return runs_.empty(); }
  const GridRuns& runs() const { return runs_; }
  // Adds a patch's matrix over its sixteen vertices [a + 4 b]; its upper triangle is read.
  void AddPatch(int i, int j, const Matrix16& matrix);
  // The same matrix for each of `count` patches side by side, from (i, j) on.
  void AddPatches(int i, int j, int count, const Matrix16& matrix);
  // y += A x. The halo of x must be filled; y gathers in its halo too. Of 1 to 4 channels.
  void AddProduct(const GridValues& x, GridValues& y) const;

 private:
  static constexpr int kDiagonals = 25;
  // Before and behind a diagonal's entries stand zeros, for it is also read from three columns off.
  static constexpr int kBefore = 8, kBehind = 16;
  // Of the vertex `di` columns and `dj` rows on: dj = 0 and di = 0..3, or dj = 1..3 and di = -3..3.
  static constexpr int Slot(int di, int dj) { return dj == 0 ? di : 4 + 7 * (dj - 1) + di + 3; }
  static std::size_t Length(const GridRun& run) { return kBefore + run.size() + kBehind; }
  std::size_t RunWith(int row, int column) const;
  void AddAlong(int row, int column, int count, int slot, double value);

  GridLayout layout_;
  GridRuns runs_;
  std::vector<std::size_t> first_;   // run of each row, and the end
  std::vector<std::size_t> starts_;  // of each run, in entries_
  std::vector<double> entries_;      // run by run, of each its diagonals one after the other
};

}  // namespace semblance
