// SPDX-License-Identifier: GPL-3.0-or-later
// Dowels seen from the shell that bridges gaps of the skull.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The shell, pressed in where a dowel would reach less than press_mm (>= 0; at most the dowel's
// depth) out of it: by what is missing there, fading out over twice and a half that (at least 10
// mm) to all sides, and nowhere below the bone. So a face can dip where the shell bridges a dip.
TriMesh IndentShell(TriMesh shell, std::span<const Dowel> dowels, const TriMesh& bone,
                    double press_mm);

struct ProjectedDowels {
  std::vector<Dowel> dowels;       // one a dowel, in order
  std::vector<std::string> notes;  // which were lifted, or end under the shell
};

// Where the shell runs over a dowel's base (sM2 under the cheek, between zygoma and mandible), the
// tissue outside the shell is what is left of the dowel there: its base is moved along it onto the
// shell and its depth is shortened by as much, so that its tip stays. A dowel that ends under the
// shell, or less than least_depth_mm (> 0) over it, keeps that depth over it. Others stay as they
// are.
ProjectedDowels ProjectOntoShell(std::span<const Dowel> dowels, const TriMesh& shell,
                                 double least_depth_mm);

}  // namespace semblance
