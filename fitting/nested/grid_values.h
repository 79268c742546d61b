// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers at the control vertices of one level, and their way to the next finer level and back.
#pragma once

#include <cstddef>
#include <vector>

#include "fitting/least_squares/patch_energy.h"

namespace semblance {

// How the vertices of a level lie in memory: row by row, each row with kHalo places more at either
// end. Of a periodic level these are copies of the columns across the seam, of an open one zeros.
struct GridLayout {
  static constexpr int kHalo = 3;
  PatchGrid grid;

  std::size_t Stride() const { return static_cast<std::size_t>(grid.Columns()) + 2 * kHalo; }
  std::size_t Size() const { return Stride() * static_cast<std::size_t>(grid.Rows()); }
  // i: -kHalo .. Columns() + kHalo - 1.
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

// Several numbers per vertex, each kind (a channel) apart from the others.
class GridValues {
 public:
  GridValues(const GridLayout& layout, int channels)
      : layout_(layout), channels_(channels), values_(layout.Size() * channels, 0.0) {}

  const GridLayout& layout() const { return layout_; }
  int channels() const { return channels_; }
  double* Channel(int c) { return values_.data() + layout_.Size() * c; }
  const double* Channel(int c) const { return values_.data() + layout_.Size() * c; }
  double* Row(int c, int j) { return Channel(c) + layout_.At(0, j); }  // of column 0
  const double* Row(int c, int j) const { return Channel(c) + layout_.At(0, j); }
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }

  void Clear() { values_.assign(values_.size(), 0.0); }
  // Copies the columns across the seam into the halo.
  void FillHalo();
  // Adds what the halo has gathered to the columns that it stands for, and empties it.
  void FoldHalo();

 private:
  GridLayout layout_;
  int channels_;
  std::vector<double> values_;
};

// finer += P coarser, P being the insertion of a knot in the middle of each patch. The halo of
// `coarser` must be filled.
void AddRefined(const GridValues& coarser, GridValues& finer);
// coarser += P^T finer.
void AddRestricted(const GridValues& finer, GridValues& coarser);

}  // namespace semblance
