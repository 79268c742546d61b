// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/nested_space.h"

#include <algorithm>

namespace semblance {

NestedSpace::NestedSpace(const HSplineShape& level0) {
  levels_.push_back({.layout = {PatchGrid::Of(level0, 0)}, .active = {}, .there = {}, .split = {}});
  levels_[0].active.assign(levels_[0].layout.Size(), 1);
  Link();
}

void NestedSpace::AddLevel() {
  const GridLayout layout = levels_.back().layout.Finer();
  levels_.push_back({.layout = layout, .active = {}, .there = {}, .split = {}});
  levels_.back().active.assign(layout.Size(), 0);
}

int NestedSpace::Overlay(int level, int i, int j) {
  if (level == finest()) {
    AddLevel();
  }
  const PatchGrid& coarse = levels_[level].layout.grid;
  NestedLevel& finer = levels_[level + 1];
  const bool open = !coarse.periodic_u;
  const int columns = finer.layout.grid.Columns(), first_u = open && i == 0 ? 0 : 2 * i + 1,
            last_u = 2 * i + (open && i == coarse.patches_u - 1 ? 4 : 3),
            first_v = j == 0 ? 0 : 2 * j + 1, last_v = 2 * j + (j == coarse.patches_v - 1 ? 4 : 3);
  int added = 0;
  for (int b = first_v; b <= last_v; ++b) {
    for (int a = first_u; a <= last_u; ++a) {
      char& active = finer.active[finer.layout.At(a % columns, b)];
      added += active == 0 ? 1 : 0;
      active = 1;
    }
  }
  return added;
}

bool NestedSpace::IsReached(int level, int i, int j) const {
  const NestedLevel& l = levels_[level];
  const int columns = l.layout.grid.Columns();
  for (int k = 0; k < 16; ++k) {
    if (l.active[l.layout.At((i + k % 4) % columns, j + k / 4)] != 0) {
      return true;
    }
  }
  return false;
}

void NestedSpace::Link() {
  for (NestedLevel& l : levels_) {
    l.split.assign(l.layout.Patches(), 0);
    l.there.assign(l.layout.Patches(), &l == &levels_.front() ? 1 : 0);
  }
  for (int level = finest(); level >= 1; --level) {
    const GridLayout &layout = levels_[level].layout, &up = levels_[level - 1].layout;
    for (int j = 0; j < layout.grid.patches_v; ++j) {
      for (int i = 0; i < layout.grid.patches_u; ++i) {
        if (levels_[level].split[layout.Patch(i, j)] != 0 || IsReached(level, i, j)) {
          levels_[level - 1].split[up.Patch(i / 2, j / 2)] = 1;
        }
      }
    }
  }
  for (int level = 0; level <= finest(); ++level) {
    NestedLevel& l = levels_[level];
    l.leaves = false;
    for (int j = 0; j < l.layout.grid.patches_v; ++j) {
      for (int i = 0; i < l.layout.grid.patches_u; ++i) {
        const std::size_t patch = l.layout.Patch(i, j);
        if (level > 0) {
          l.there[patch] = levels_[level - 1].split[levels_[level - 1].layout.Patch(i / 2, j / 2)];
        }
        l.leaves = l.leaves || (l.there[patch] != 0 && l.split[patch] == 0);
      }
    }
  }
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

// Vertex i of a level is a sum of 2 i - 3 .. 2 i + 1 of the next.
bool NestedSpace::IsCovered(int level, int i, int j) const {
  if (level == finest()) {
    return false;
  }
  const GridLayout& finer = levels_[level + 1].layout;
  const int columns = finer.grid.Columns();
  for (int b = std::max(2 * j - 3, 0); b <= std::min(2 * j + 1, finer.grid.Rows() - 1); ++b) {
    for (int a = 2 * i - 3; a <= 2 * i + 1; ++a) {
      const bool inside = finer.grid.periodic_u || (a >= 0 && a < columns);
      if (inside && levels_[level + 1].active[finer.At((a + columns) % columns, b)] == 0) {
        return false;
      }
    }
  }
  return true;
}

int NestedSpace::Vertices() const {
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

}  // namespace semblance
