// SPDX-License-Identifier: GPL-3.0-or-later
// The normal equations of all unknowns of an OffsetTree.
#pragma once

#include <span>
#include <vector>

#include "fitting/adaptive/offset_tree.h"
#include "fitting/least_squares/normal_equations.h"

namespace semblance {

// The energies of one level's patches; x^T form x for each coordinate.
struct LevelForms {
  PatchForm displacement = PatchForm::Zero();  // of the displacement from the template
  PatchForm surface = PatchForm::Zero();
};

// One a level, of the smoothness and membrane terms together, each times `scale`. lengths_mm: what
// [0,1] stands for along u and v.
std::vector<LevelForms> FormsOf(const HSplineShape& shape, std::span<const Term> terms,
                                const Vec2& lengths_mm, double scale = 1);

// Sum of the energies over the surface, mm^2.
double EnergyOf(const OffsetTree& tree, std::span<const LevelForms> forms);

struct TreeSystem {
  SparseMatrix lower;      // triangle
  Eigen::MatrixX3d right;  // unknowns x 3: half of minus the gradient at the tree's surface
};

// Of point_scale * sum w |e|^2 + the energies; the tree must be measured. Each leaf gives its
// sixteen vertices' matrix, which is taken up the quadtree by the refinement matrices, so that the
// work grows with the patches and not with the points or the pairs of levels. forms: one a level,
// or none. Unknowns that finer ones cover have empty rows and columns.
TreeSystem Assemble(const OffsetTree& tree, double point_scale, std::span<const LevelForms> forms);

}  // namespace semblance
