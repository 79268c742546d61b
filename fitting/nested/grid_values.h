// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers at the control vertices of one level, and their way to the next finer level and back.
#pragma once

#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <vector>

#include "fitting/least_squares/patch_energy.h"

namespace semblance {

// How the vertices of a level lie in memory: row by row, each row with kHalo places more at either
// end. Along periodic u these are copies of the columns across the seam, along open u nothing. Room
// for a block follows, so that work in blocks may reach beyond a row. Before the first row and
// behind the last one there are kHalo rows more; along periodic v those behind are copies of the
// first ones, which is all that is asked for across that seam.
struct GridLayout {
  static constexpr int kHalo = 3, kBlock = 8;
  PatchGrid grid;

  std::size_t Stride() const {
    return static_cast<std::size_t>(grid.Columns()) + std::size_t{2} * kHalo + kBlock;
  }
  std::size_t Size() const { return Stride() * static_cast<std::size_t>(grid.Rows()); }
  // i: -kHalo .. Columns() + kHalo - 1; j: likewise of rows.
  std::size_t At(int i, int j) const {
    return static_cast<std::size_t>(j) * Stride() + static_cast<std::size_t>(i + kHalo);
  }
  std::size_t Patches() const { return static_cast<std::size_t>(grid.patches_u) * grid.patches_v; }
  std::size_t Patch(int i, int j) const {
    return static_cast<std::size_t>(j) * grid.patches_u + static_cast<std::size_t>(i);
  }
  GridLayout Finer() const {
    return {{.patches_u = 2 * grid.patches_u,
             .patches_v = 2 * grid.patches_v,
             .periodic_u = grid.periodic_u}};
  }
};

// Vertices of one row that stand side by side, in whole blocks: the last may reach beyond those
// that are wanted, and beyond the row.
struct GridRun {
  std::size_t at = 0;  // of the first, GridLayout::At
  int row = 0, begin = 0, blocks = 0;
  int size() const { return GridLayout::kBlock * blocks; }
};
// Row by row, and by column; no two share a place.
using GridRuns = std::vector<GridRun>;

// The rows of patches that a row of vertices belongs to; -1 where one would lie beyond a border.
std::array<int, 4> RowsOfPatches(const PatchGrid& grid, int row);

// Those that hold the sixteen vertices of every patch that is not 0 (GridLayout::Patch).
GridRuns RunsAround(const GridLayout& layout, const std::vector<char>& patches);

// Several numbers per vertex, each kind (a channel) apart from the others. Memory that nothing was
// written to costs nothing, so that a fine level with few vertices stays small.
class GridValues {
 public:
  GridValues() = default;
  GridValues(const GridLayout& layout, int channels);

  const GridLayout& layout() const { return layout_; }
  int channels() const { return channels_; }
  double* Channel(int c) { return values_.get() + Start(c); }  // by GridLayout::At
  const double* Channel(int c) const { return values_.get() + Start(c); }
  double* Row(int c, int j) { return Channel(c) + layout_.At(0, j); }  // of column 0
  const double* Row(int c, int j) const { return Channel(c) + layout_.At(0, j); }

  void Clear(const GridRuns& runs);
  // Copies the columns across the seam into the halo of the runs' rows.
  void FillHalo(const GridRuns& runs);
  // Adds what the halo has gathered to the vertices that it stands for, and empties it; also of the
  // three rows beneath each run.
  void FoldHalo(const GridRuns& runs);

 private:
  struct Free {
    void operator()(double* values) const { std::free(values); }
  };
  std::size_t Start(int c) const {
    const std::size_t apart = GridLayout::kHalo * layout_.Stride();
    return static_cast<std::size_t>(c) * (layout_.Size() + 2 * apart) + apart;
  }
  void FillRow(double* row) const;
  void FoldRow(double* row) const;

  GridLayout layout_;
  int channels_ = 0;
  std::unique_ptr<double[], Free> values_;
};

// On the finer level's runs: finer += P coarser, P being the insertion of a knot in the middle of
// each patch. The halo of `coarser` must be filled.
void AddRefined(const GridValues& coarser, const GridRuns& runs, GridValues& finer);
// From the finer level's runs: coarser += P^T finer. The halo of `coarser` gathers too.
void AddRestricted(const GridValues& finer, const GridRuns& runs, GridValues& coarser);

}  // namespace semblance
