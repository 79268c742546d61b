// SPDX-License-Identifier: GPL-3.0-or-later
// The levels of a nested fit: the active vertices of each level, and the patches that they split.
#pragma once

#include <vector>

#include "fitting/nested/grid_values.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

struct NestedLevel {
  GridLayout layout;
  std::vector<char> active;   // per vertex, by GridLayout::At; all 1 on level 0
  std::vector<char> present;  // per patch: its parent is split (level 0: all 1)
  std::vector<char> split;    // per patch: an active finer vertex reaches into it
  bool leaves = false;        // some patch is present and not split
  GridRuns runs;              // all vertices of the patches that are present
};

// The leaves are the patches that are present and not split; they tile the domain. Coarse vertices
// stay unknowns where finer ones cover them. The representation of a surface is then not unique,
// which does not affect conjugate gradients, and the coarse vertices carry the common part of the
// fine ones.
class NestedSpace {
 public:
  explicit NestedSpace(const HSplineShape& level0);

  int finest() const { return static_cast<int>(levels_.size()) - 1; }
  const NestedLevel& operator[](int level) const { return levels_[level]; }
  // The level of the leaf that contains the place (x, y), in patches of level 0.
  int LeafLevel(double x, double y) const;
  // The number of active vertices that are not covered (IsCovered).
  int Vertices() const { return vertices_; }
  // The finest level up to which all vertices of all levels are active.
  int FinestWhole() const;
  // Per patch of a level (GridLayout::Patch), whether it is a leaf.
  std::vector<char> Leaves(int level) const;
  // Returns whether all vertices of the next level whose sum the vertex is are active.
  bool IsCovered(int level, int i, int j) const;

  // Activates the vertices of the next level on the knots of a patch, and those beyond a border.
  // Returns the number of newly active vertices. Call Link before any other member.
  int Overlay(int level, int i, int j);
  // Updates `present`, `split`, `leaves` and `runs` after Overlay.
  void Link();

 private:
  void AddLevel();
  void SplitAbove(int level);
  int CountVertices() const;

  std::vector<NestedLevel> levels_;
  int vertices_ = 0;
};

}  // namespace semblance::fitting
