// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/surface_cells.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/hspline/patch_tree.h"

namespace semblance {

std::array<DomainCell, 4> Children(const DomainCell& c) {
  return {DomainCell{c.level + 1, 2 * c.i, 2 * c.j}, DomainCell{c.level + 1, 2 * c.i + 1, 2 * c.j},
          DomainCell{c.level + 1, 2 * c.i, 2 * c.j + 1},
          DomainCell{c.level + 1, 2 * c.i + 1, 2 * c.j + 1}};
}

// The second derivatives are convex combinations of the control vertices' second differences.
double ChordBound(const HSplineSurface& surface, const DomainCell& cell) {
  const int level = std::min(cell.level, surface.shape().max_level), finer = cell.level - level;
  const std::array<Vec3, 16> p = surface.PatchVertices({level, cell.i >> finer, cell.j >> finer});
  double uu = 0, uv = 0, vv = 0;
  for (int b = 0; b < 4; ++b) {
    for (int a = 0; a < 2; ++a) {
      const int row = a + 4 * b, column = b + 4 * a;
      uu = std::max(uu, (p[row] - 2 * p[row + 1] + p[row + 2]).norm());
      vv = std::max(vv, (p[column] - 2 * p[column + 4] + p[column + 8]).norm());
    }
  }
  for (int k = 0; k < 9; ++k) {
    const int at = k % 3 + 4 * (k / 3);
    uv = std::max(uv, (p[at] - p[at + 1] - p[at + 4] + p[at + 5]).norm());
  }
  return std::ldexp((uu + 2 * uv + vv) / 8, -2 * finer);
}

namespace {

[[noreturn]] void TooFine(double chord_mm) {
  throw InputError(fmt::format(
      "tessellation: a chord error of {} mm needs too many triangles; allow a larger one",
      chord_mm));
}

// Counts the cells into which a cell must be split; infinite if they would be too small. Beyond the
// finest level each split quarters the bound, so that the count needs no actual cells.
double CellsWithin(const HSplineSurface& surface, const DomainCell& cell, double chord_mm) {
  const double bound = ChordBound(surface, cell);
  if (bound <= chord_mm) {
    return 1;
  }
  if (cell.level >= surface.shape().max_level) {
    const double splits = std::ceil(std::log2(bound / chord_mm) / 2);
    return cell.level + splits > kDeepestCell ? std::numeric_limits<double>::infinity()
                                              : std::ldexp(1, 2 * static_cast<int>(splits));
  }
  double count = 0;
  for (const DomainCell& child : Children(cell)) {
    count += CellsWithin(surface, child, chord_mm);
  }
  return count;
}

void SplitToChord(const HSplineSurface& surface, const DomainCell& cell, double chord_mm,
                  std::set<DomainCell>& cells) {
  if (ChordBound(surface, cell) <= chord_mm) {
    cells.insert(cell);
    return;
  }
  if (cell.level == kDeepestCell) {
    TooFine(chord_mm);
  }
  for (const DomainCell& child : Children(cell)) {
    SplitToChord(surface, child, chord_mm, cells);
  }
}

// Splits the cell that covers `fine`, if any, until it is coarser by at most one level.
void RefineAt(const DomainCell& fine, std::set<DomainCell>& cells, std::vector<DomainCell>& open) {
  for (int up = 0; up <= fine.level; ++up) {
    const DomainCell cell{fine.level - up, fine.i >> up, fine.j >> up};
    if (up < 2 && cells.contains(cell)) {
      return;
    }
    if (up >= 2 && cells.erase(cell) > 0) {
      for (const DomainCell& child : Children(cell)) {
        cells.insert(child);
        open.push_back(child);
      }
      RefineAt(fine, cells, open);
      return;
    }
  }
}

}  // namespace

double CellsToChord(const HSplineSurface& surface, double chord_mm) {
  double count = 0;
  const PatchTree patches(surface);
  for (const PatchId& leaf : patches.leaves()) {
    count += CellsWithin(surface, leaf, chord_mm);
  }
  return count;
}

std::set<DomainCell> CellsWithinChord(const HSplineSurface& surface, double chord_mm) {
  if (!(chord_mm > 0) || !std::isfinite(chord_mm)) {
    throw InputError(fmt::format(
        "tessellation: the chord error is {} mm; it must be above 0 and finite", chord_mm));
  }
  if (!(CellsToChord(surface, chord_mm) <= kMostCells)) {
    TooFine(chord_mm);
  }
  std::set<DomainCell> cells;
  const PatchTree patches(surface);
  for (const PatchId& leaf : patches.leaves()) {
    SplitToChord(surface, leaf, chord_mm, cells);
  }
  return cells;
}

void BalanceCells(const HSplineShape& shape, std::set<DomainCell>& cells) {
  std::vector<DomainCell> open(cells.begin(), cells.end());
  while (!open.empty()) {
    const DomainCell cell = open.back();
    open.pop_back();
    if (!cells.contains(cell)) {
      continue;  // already split
    }
    for (const auto& [i, j] : {std::pair{cell.i - 1, cell.j}, std::pair{cell.i + 1, cell.j},
                               std::pair{cell.i, cell.j - 1}, std::pair{cell.i, cell.j + 1}}) {
      const DomainCell beside{cell.level,
                              PlaceAmong(shape.PatchesU(cell.level), i, shape.ClosedU()),
                              PlaceAmong(shape.PatchesV(cell.level), j, shape.ClosedV())};
      if (beside.i >= 0 && beside.j >= 0) {
        RefineAt(beside, cells, open);
      }
    }
  }
}

}  // namespace semblance
