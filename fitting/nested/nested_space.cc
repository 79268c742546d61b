// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_space.h"

#include <algorithm>

namespace semblance::fitting {

NestedSpace::NestedSpace(const HSplineShape& level0) {
  levels_.emplace_back().layout = {PatchGrid::Of(level0, 0)};
  levels_[0].active.assign(levels_[0].layout.Size(), 1);
  Link();
}

void NestedSpace::AddLevel() {
  const GridLayout layout = levels_.back().layout.Finer();
  levels_.emplace_back().layout = layout;
  levels_.back().active.assign(layout.Size(), 0);
}

int NestedSpace::Overlay(int level, int i, int j) {
  if (level == finest()) {
    AddLevel();
  }
  const PatchGrid& coarse = levels_[level].layout.grid;
  NestedLevel& finer = levels_[level + 1];
  const auto first = [](int k, bool closed) { return !closed && k == 0 ? 0 : 2 * k + 1; };
  const auto last = [](int k, int patches, bool closed) {
    return 2 * k + (!closed && k == patches - 1 ? 4 : 3);
  };
  const int columns = finer.layout.grid.Columns(),
            last_u = last(i, coarse.patches_u, coarse.periodic_u),
            last_v = last(j, coarse.patches_v, false);
  int added = 0;
  for (int b = first(j, false); b <= last_v; ++b) {
    for (int a = first(i, coarse.periodic_u); a <= last_u; ++a) {
      char& active = finer.active[finer.layout.At(a % columns, b)];
      added += active == 0 ? 1 : 0;
      active = 1;
    }
  }
  return added;
}

// Marks each patch of the coarser level that has a child which is split or has an active vertex.
void NestedSpace::SplitAbove(int level) {
  const NestedLevel& l = levels_[level];
  const PatchGrid& grid = l.layout.grid;
  const int columns = grid.Columns();
  std::vector<char>& split = levels_[level - 1].split;
  std::vector<char> across(grid.patches_u);  // per patch: an active vertex of the row reaches it
  for (int row = 0; row < grid.Rows(); ++row) {
    const char* const active = l.active.data() + l.layout.At(0, row);
    for (int i = 0; i < grid.patches_u; ++i) {
      across[i] = 0;
      for (int a = 0; a < 4; ++a) {
        across[i] |= active[i + a < columns ? i + a : (i + a) % columns];
      }
    }
    for (const int j : PatchRowsAround(grid, row)) {
      if (j < 0) {
        continue;
      }
      char* const above = split.data() + levels_[level - 1].layout.Patch(0, j / 2);
      for (int i = 0; i < grid.patches_u; ++i) {
        above[i / 2] |= across[i];
      }
    }
  }
  for (int j = 0; j < grid.patches_v; ++j) {
    for (int i = 0; i < grid.patches_u; ++i) {
      split[levels_[level - 1].layout.Patch(i / 2, j / 2)] |= l.split[l.layout.Patch(i, j)];
    }
  }
}

void NestedSpace::Link() {
  for (NestedLevel& l : levels_) {
    l.split.assign(l.layout.Patches(), 0);
    l.present.assign(l.layout.Patches(), &l == &levels_.front() ? 1 : 0);
  }
  for (int level = finest(); level >= 1; --level) {
    SplitAbove(level);
  }
  for (int level = 0; level <= finest(); ++level) {
    NestedLevel& l = levels_[level];
    for (int j = 0; level > 0 && j < l.layout.grid.patches_v; ++j) {
      for (int i = 0; i < l.layout.grid.patches_u; ++i) {
        l.present[l.layout.Patch(i, j)] =
            levels_[level - 1].split[levels_[level - 1].layout.Patch(i / 2, j / 2)];
      }
    }
    l.leaves = l.present != l.split;
    l.runs = RunsAround(l.layout, l.present);
  }
  vertices_ = CountVertices();
}

int NestedSpace::FinestWhole() const {
  int level = 0;
  const auto whole = [](const NestedLevel& l) {
    const PatchGrid& grid = l.layout.grid;
    return std::count(l.active.begin(), l.active.end(), 1) ==
           static_cast<std::ptrdiff_t>(grid.Columns()) * grid.Rows();
  };
  while (level < finest() && whole(levels_[level + 1])) {
    ++level;
  }
  return level;
}

std::vector<char> NestedSpace::Leaves(int level) const {
  const NestedLevel& l = levels_[level];
  std::vector<char> leaves(l.present.size());
  for (std::size_t p = 0; p < leaves.size(); ++p) {
    leaves[p] = l.present[p] != 0 && l.split[p] == 0 ? 1 : 0;
  }
  return leaves;
}

int NestedSpace::LeafLevel(double x, double y) const {
  for (int level = 0;; ++level) {
    const GridLayout& layout = levels_[level].layout;
    const double scale = 1 << level;
    const int i = std::min(static_cast<int>(x * scale), layout.grid.patches_u - 1),
              j = std::min(static_cast<int>(y * scale), layout.grid.patches_v - 1);
    if (levels_[level].split[layout.Patch(i, j)] == 0) {
      return level;
    }
  }
}

// The B-spline of vertex i is a sum of those of vertices 2 i - 3 .. 2 i + 1 of the next level.
bool NestedSpace::IsCovered(int level, int i, int j) const {
  if (level == finest()) {
    return false;
  }
  const GridLayout& finer = levels_[level + 1].layout;
  for (int b = 2 * j - 3; b <= 2 * j + 1; ++b) {
    const int row = WrapIndex(finer.grid.Rows(), b, false);
    for (int a = 2 * i - 3; row >= 0 && a <= 2 * i + 1; ++a) {
      const int column = WrapIndex(finer.grid.Columns(), a, finer.grid.periodic_u);
      if (column >= 0 && levels_[level + 1].active[finer.At(column, row)] == 0) {
        return false;
      }
    }
  }
  return true;
}

int NestedSpace::CountVertices() const {
  int count = 0;
  for (int level = 0; level <= finest(); ++level) {
    const GridLayout& layout = levels_[level].layout;
    for (int j = 0; j < layout.grid.Rows(); ++j) {
      for (int i = 0; i < layout.grid.Columns(); ++i) {
        const bool active = levels_[level].active[layout.At(i, j)] != 0;
        count += active && !IsCovered(level, i, j) ? 1 : 0;
      }
    }
  }
  return count;
}

}  // namespace semblance::fitting
