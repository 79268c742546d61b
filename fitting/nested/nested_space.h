// SPDX-License-Identifier: GPL-3.0-or-later
// The levels of a nested fit: which vertices take part, and on which level each place is finest.
#pragma once

#include <vector>

#include "fitting/nested/grid_values.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

struct NestedLevel {
  GridLayout layout;
  std::vector<char> active;  // of each vertex, by GridLayout::At; of level 0 all
  std::vector<char> there;   // of each patch: its parent is split
  std::vector<char> split;   // of each patch: finer vertices reach into it
  bool leaves = false;       // some patch is there and not split
  GridRuns runs;             // all vertices of the patches that are there
};

// Coarse vertices stay unknowns where finer ones cover them: the many ways to write a surface do no
// harm to conjugate gradients, and the coarse ones carry what the fine ones have in common.
class NestedSpace {
 public:
  explicit NestedSpace(const HSplineShape& level0);

  int finest() const { return static_cast<int>(levels_.size()) - 1; }
  const NestedLevel& operator[](int level) const { return levels_[level]; }
  // The level whose patch holds the point, in patches of level 0, and is no more split.
  int LeafLevel(double x, double y) const;
  // Vertices that are active and not sums of active ones of the next level.
  int Vertices() const { return vertices_; }
  // The finest level of which, as of those before it, all vertices are active.
  int FinestWhole() const;
  // On every level those patches that are there and not split, as GridLayout::Patch has them.
  std::vector<char> Leaves(int level) const;
  bool IsCovered(int level, int i, int j) const;

  // Makes the vertices of the next level on the knots of a patch active, and those beyond a border.
  // Returns how many were not. Link before anything else is asked.
  int Overlay(int level, int i, int j);
  void Link();

 private:
  void AddLevel();
  void SplitAbove(int level);
  int CountVertices() const;

  std::vector<NestedLevel> levels_;
  int vertices_ = 0;
};

}  // namespace semblance
