// SPDX-License-Identifier: GPL-3.0-or-later
// The normal matrix of one level, which couples vertices up to three columns and rows apart.
#pragma once

#include <span>
#include <vector>

#include "fitting/nested/grid_values.h"

namespace semblance::fitting {

// A symmetric matrix, stored by its 25 diagonals on and above the main one, separately for each run
// of vertices, so that products run along the rows of the grid.
class StencilMatrix {
 public:
  StencilMatrix() = default;
  // runs: all vertices of the patches that will be added.
  StencilMatrix(const GridLayout& layout, GridRuns runs);

  bool empty() const { return runs_.empty(); }
  const GridRuns& runs() const { return runs_; }
  // Adds a patch's matrix over its sixteen vertices [a + 4 b]. Only its upper triangle is read.
  void AddPatch(int i, int j, const Matrix16& matrix);
  // Adds the same matrix for `count` adjacent patches from (i, j) on.
  void AddPatches(int i, int j, int count, const Matrix16& matrix);
  // y += A x for 1 to 4 channels. The halo of x must be filled; contributions across the seam go to
  // the halo of y.
  void AddProduct(const GridValues& x, GridValues& y) const;

 private:
  static constexpr int kDiagonals = 25;
  // Zeros before and after a diagonal's entries, because products also read it shifted by three
  // columns.
  static constexpr int kBefore = 8, kBehind = 16;
  // The diagonal of the vertex `di` columns and `dj` rows ahead: dj = 0 and di = 0 .. 3, or dj = 1
  // .. 3 and di = -3 .. 3.
  static constexpr int Slot(int di, int dj) { return dj == 0 ? di : 4 + 7 * (dj - 1) + di + 3; }
  static std::size_t Length(const GridRun& run) { return kBefore + run.size() + kBehind; }
  std::size_t RunWith(int row, int column) const;
  void AddAlong(int row, int column, int count, int slot, double value);

  GridLayout layout_;
  GridRuns runs_;
  std::vector<std::size_t> first_;   // first run of each row, and the end
  std::vector<std::size_t> starts_;  // start of each run in entries_
  std::vector<double> entries_;      // run by run, diagonal by diagonal
};

}  // namespace semblance::fitting
