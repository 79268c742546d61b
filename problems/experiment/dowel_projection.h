// SPDX-License-Identifier: GPL-3.0-or-later
// From dowels on bone to dowels on the shell, and to points of a fit.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fitting/problem/fit_target.h"
#include "fitting/problem/placement.h"
#include "interp/dowels/dowel.h"
#include "interp/dowels/dowel_network.h"
#include "problems/experiment/experiment.h"
#include "problems/face/template_face.h"
#include "problems/subject/extra_sites.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// ---------------------------------------------------------------------------------------------
// Onto the shell
// ---------------------------------------------------------------------------------------------

// The shell bridges the gaps of the skull, so it may run over a dowel's base (sM2 under the cheek,
// between zygoma and mandible). IndentShell adds a dimple wherever a dowel would reach out of the
// shell by less than press_mm (>= 0; at most the dowel's depth). A dimple is as deep as the missing
// length. It fades out over 2.5 times that depth (at least 10 mm) to all sides, and never goes
// below the bone. So a face can have a hollow where the shell bridges one.
TriMesh IndentShell(TriMesh shell, std::span<const Dowel> dowels_on_bone, const TriMesh& bone,
                    double press_mm);

struct ProjectedDowels {
  std::vector<Dowel> dowels_on_shell;  // one per dowel on bone, in the same order
  std::vector<std::string> notes;      // the dowels that were lifted or end under the shell
};

// If the shell runs over a dowel's base, the base moves along the dowel onto the shell and the
// depth shrinks by the same length, so that the tip stays. A dowel that ends under the shell, or
// less than least_depth_mm (> 0) over it, keeps least_depth_mm over it. All other dowels stay as
// they are. `query` must be that of the shell.
ProjectedDowels ProjectOntoShell(std::span<const Dowel> dowels_on_bone, const TriMesh& shell,
                                 const MeshQuery& query, double least_depth_mm);

// ---------------------------------------------------------------------------------------------
// Into the fit
// ---------------------------------------------------------------------------------------------

// The tips of the dowels whose (u,v) is known before the face is placed: set by hand (`sites`),
// else that of the generic face. In the dowels' order.
FitTarget KnownDowels(std::span<const Dowel> dowels, const TemplateFace& face,
                      const ExtraSites& sites);

// The similarity that brings the generic face to known dowels. Throws as PlaceTemplate does.
Similarity PlaceOnDowels(const TemplateFace& generic, const FitTarget& known,
                         const PlacementOptions& options);

// The known dowels and those that are not at a standard site, in the dowels' order. The (u,v) of
// the latter follow from experiment.inserted_uv:
//   kNeighbours: in an area of known dowels the barycentric mean of their (u,v), with the weights
//     that its depth would have (thesis 2.2, 4.2). Elsewhere as kRay.
//   kRay: the point in which the ray of the dowel meets `placed`, the face in the subject's frame
//     (thesis 4.2). If the ray misses, it is the point of the surface nearest to the tip.
// network: the areas of the dowels. Areas with a dowel that is not known are closed over by those
// of its neighbours (LeaveOutDowels).
FitTarget AllDowels(std::span<const Dowel> dowels, const DowelNetwork& network,
                    const TemplateFace& placed, const Experiment& experiment);

}  // namespace semblance::problems
