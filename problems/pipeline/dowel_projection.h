// SPDX-License-Identifier: GPL-3.0-or-later
// From dowels on bone to dowels on the shell, which bridges the gaps of the skull and so may run
// over a dowel's base (sM2 under the cheek, between zygoma and mandible).
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The shell with a dimple wherever a dowel would reach less than press_mm (>= 0; at most the
// dowel's depth) out of it. A dimple is as deep as what is missing there. It fades out over 2.5
// times that depth (at least 10 mm) to all sides, and nowhere goes below the bone. So a face can
// dip where the shell bridges a dip.
TriMesh IndentShell(TriMesh shell, std::span<const Dowel> dowels_on_bone, const TriMesh& bone,
                    double press_mm);

struct ProjectedDowels {
  std::vector<Dowel> dowels_on_shell;  // one per dowel on bone, in the same order
  std::vector<std::string> notes;      // which were lifted, or end under the shell
};

// Where the shell runs over a dowel's base, only what reaches out of the shell is left of the
// dowel: its base is moved along it onto the shell, and its depth is shortened by as much, so that
// its tip stays. A dowel that ends under the shell, or less than least_depth_mm (> 0) over it,
// keeps least_depth_mm over it. All others stay as they are.
ProjectedDowels ProjectOntoShell(std::span<const Dowel> dowels_on_bone, const TriMesh& shell,
                                 double least_depth_mm);

}  // namespace semblance
