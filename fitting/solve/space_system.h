// SPDX-License-Identifier: GPL-3.0-or-later
// The normal equations of a HierarchicalSplineSpace, one scalar matrix for x, y and z.
#pragma once

#include <span>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance::fitting {

// Normal equations for a step from the present surface; x, y and z share the matrix.
struct NormalSystem {
  SparseMatrix lower;      // lower triangle
  Eigen::MatrixX3d right;  // unknowns x 3: -gradient / 2
};

// The energies of one level's patches; each is x^T form x for one coordinate x of the vertices.
struct LevelStiffness {
  ElementStiffness displacement = ElementStiffness::Zero();  // x: displacement from the template
  ElementStiffness surface = ElementStiffness::Zero();
};

// The energies of the smoothness and membrane terms together, one form per level. lengths_mm:
// lengths of [0,1] along u and v.
std::vector<LevelStiffness> StiffnessByLevel(const HSplineShape& shape, std::span<const Term> terms,
                                             const Vec2& lengths_mm);

// The sum of the energies over the surface, mm^2.
double TotalEnergy(const HierarchicalSplineSpace& space, std::span<const LevelStiffness> forms);

enum class SystemPart { kBoth, kRight };

// Assembles the normal equations of point_scale * sum w |e|^2 + the energies over the unknowns of a
// measured space. The matrix of each leaf's sixteen vertices is carried up the quadtree by the
// refinement matrices, so the work grows with the number of patches, not with the points or the
// pairs of levels. forms: one per level, or empty. kRight leaves the matrix 0 x 0.
NormalSystem Assemble(const HierarchicalSplineSpace& space, double point_scale,
                      std::span<const LevelStiffness> forms, SystemPart part = SystemPart::kBoth);

// Adds the rows of terms (RowTerm) to the normal equations. net: the present unknowns.
void AddTermRows(std::span<const Term> terms, const LevelView& view, const ControlNet& net,
                 SystemPart part, NormalSystem& system);

}  // namespace semblance::fitting
