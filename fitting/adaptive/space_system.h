// SPDX-License-Identifier: GPL-3.0-or-later
// The normal equations of all dofs of an HierarchicalSplineSpace.
#pragma once

#include <span>
#include <vector>

#include "fitting/least_squares/normal_equations.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/terms/term.h"

namespace semblance {

// The energies of one level's patches; x^T form x for each coordinate.
struct LevelStiffness {
  ElementStiffness displacement =
      ElementStiffness::Zero();  // of the displacement from the template
  ElementStiffness surface = ElementStiffness::Zero();
};

// One a level, of the smoothness and membrane terms together, each times `scale`. lengths_mm: what
// [0,1] stands for along u and v.
std::vector<LevelStiffness> StiffnessByLevel(const HSplineShape& shape, std::span<const Term> terms,
                                             const Vec2& lengths_mm, double scale = 1);

// Sum of the energies over the surface, mm^2.
double EnergyOf(const HierarchicalSplineSpace& space, std::span<const LevelStiffness> forms);

// Of point_scale * sum w |e|^2 + the energies; the space must be measured. Each leaf gives its
// sixteen vertices' matrix, which is taken up the quadtree by the refinement matrices, so that the
// work grows with the patches and not with the points or the pairs of levels. forms: one per level,
// or none. Unknowns that finer ones cover have empty rows and columns.
NormalSystem Assemble(const HierarchicalSplineSpace& space, double point_scale,
                      std::span<const LevelStiffness> forms);

}  // namespace semblance
