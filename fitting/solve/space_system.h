// SPDX-License-Identifier: GPL-3.0-or-later
// The normal equations of a HierarchicalSplineSpace, one scalar matrix for x, y and z.
#pragma once

#include <span>
#include <vector>

#include "fitting/least_squares/sparse_factor.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term.h"

namespace semblance {

// In steps from where a surface stands, the same matrix for x, y and z.
struct NormalSystem {
  SparseMatrix lower;      // triangle
  Eigen::MatrixX3d right;  // unknowns x 3: half of minus the gradient
};

// The energies of one level's patches; x^T form x for each coordinate.
struct LevelStiffness {
  ElementStiffness displacement =
      ElementStiffness::Zero();  // of the displacement from the template
  ElementStiffness surface = ElementStiffness::Zero();
};

// One per level, of the smoothness and membrane terms together. lengths_mm: what [0,1] stands for
// along u and v.
std::vector<LevelStiffness> StiffnessByLevel(const HSplineShape& shape, std::span<const Term> terms,
                                             const Vec2& lengths_mm);

// Sum of the energies over the surface, mm^2.
double EnergyOf(const HierarchicalSplineSpace& space, std::span<const LevelStiffness> forms);

enum class SystemPart { kBoth, kRight };

// Of point_scale * sum w |e|^2 + the energies, over the unknowns; the space must be measured. Each
// leaf gives its sixteen vertices' matrix, which is taken up the quadtree by the refinement
// matrices, so that the work grows with the patches and not with the points or the pairs of levels.
// forms: one per level, or none. kRight leaves the matrix 0 x 0.
NormalSystem Assemble(const HierarchicalSplineSpace& space, double point_scale,
                      std::span<const LevelStiffness> forms, SystemPart part = SystemPart::kBoth);

// Adds the rows of other terms that treat x, y and z alike, as they stand to a net of the unknowns.
void AddRowsOf(std::span<const Term> terms, const LevelView& view, const ControlNet& net,
               SystemPart part, NormalSystem& system);

}  // namespace semblance
