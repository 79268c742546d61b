// SPDX-License-Identifier: GPL-3.0-or-later
// Values at the control vertices of one level, their refinement to the next finer level and its
// transpose, and sums over them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <vector>

#include "fitting/least_squares/patch_energy.h"

namespace semblance::fitting {

// The memory layout of a level's vertices: row by row, each row with kHalo additional places at
// either end. For periodic u these hold copies of the columns across the seam; for open u they are
// unused. Space for a block follows each row, so that loops over blocks may reach beyond it. kHalo
// additional rows lie before the first row and after the last one.
struct GridLayout {
  static constexpr int kHalo = 3, kBlock = 8;
  PatchGrid grid;

  std::size_t Stride() const {
    return static_cast<std::size_t>(grid.Columns()) + std::size_t{2} * kHalo + kBlock;
  }
  std::size_t Size() const { return Stride() * static_cast<std::size_t>(grid.Rows()); }
  // i: -kHalo .. Columns() + kHalo - 1; j: -kHalo .. Rows() + kHalo - 1.
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

// Adjacent vertices of one row, in whole blocks. The last block may reach beyond the wanted
// vertices, and beyond the row.
struct GridRun {
  std::size_t at = 0;  // GridLayout::At of the first vertex
  int row = 0, begin = 0, blocks = 0;
  int size() const { return GridLayout::kBlock * blocks; }
};
// Runs sorted by row, then column. No two runs overlap.
using GridRuns = std::vector<GridRun>;

// The rows of patches that contain a row of vertices; -1 for a row beyond a border.
std::array<int, 4> PatchRowsAround(const PatchGrid& grid, int row);

// The runs that contain the sixteen vertices of every patch with a non-zero flag
// (GridLayout::Patch).
GridRuns RunsAround(const GridLayout& layout, const std::vector<char>& patches);

// Several values per vertex, stored channel by channel. Memory comes from calloc, and pages that
// nothing is written to take no memory, so a fine level with few vertices stays small.
class GridValues {
 public:
  GridValues() = default;
  GridValues(const GridLayout& layout, int channels);

  const GridLayout& layout() const { return layout_; }
  int channels() const { return channels_; }
  double* Channel(int c) { return values_.get() + Start(c); }  // by GridLayout::At
  const double* Channel(int c) const { return values_.get() + Start(c); }
  double* Row(int c, int j) { return Channel(c) + layout_.At(0, j); }  // at column 0
  const double* Row(int c, int j) const { return Channel(c) + layout_.At(0, j); }

  void Clear(const GridRuns& runs);
  // Copies the columns across the seam into the halo of the runs' rows.
  void FillHalo(const GridRuns& runs);
  // Adds the halo's values to the vertices that it mirrors, and clears it, in the runs' rows and
  // the three rows after each.
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

// finer += P coarser on the finer level's runs, where P inserts a knot in the middle of each patch.
// The halo of `coarser` must be filled.
void AddRefined(const GridValues& coarser, const GridRuns& runs, GridValues& finer);
// coarser += P^T finer from the finer level's runs. Contributions across the seam go to the halo of
// `coarser` (FoldHalo).
void AddRestricted(const GridValues& finer, const GridRuns& runs, GridValues& coarser);

// The following sums and updates work on the runs alone, eight values at a time. Pointers refer to
// places by GridLayout::At. The eight partial sums are added in a fixed order, so that every
// processor gives the same bits.

double DotOn(const GridRuns& runs, const double* a, const double* b);
// The sum of inverse * residual^2.
double SquaresOn(const GridRuns& runs, const double* inverse, const double* residual);
// to = from.
void CopyOn(const GridRuns& runs, const double* from, double* to);
// inverse = 1 / (data + factor * energy) where `active`, else 0.
void InvertOn(const GridRuns& runs, const double* data, const double* energy, double factor,
              const char* active, double* inverse);
// residual -= product. Returns SquaresOn of the new residual.
double SubtractOn(const GridRuns& runs, const double* inverse, const double* product,
                  double* residual);

// The vectors of a step of conjugate gradients, for one channel of one level.
struct GridStep {
  const double* inverse;  // of the diagonal: the preconditioner
  const double* product;  // matrix times direction
  double* direction;
  double* residual;
  double* solution;
};
// solution += length * direction, residual -= length * product. Returns the sum of inverse *
// residual^2.
double AdvanceOn(const GridRuns& runs, const GridStep& step, double length);
// direction = inverse * residual + factor * direction.
void TurnOn(const GridRuns& runs, const GridStep& step, double factor);

}  // namespace semblance::fitting
