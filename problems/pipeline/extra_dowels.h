// SPDX-License-Identifier: GPL-3.0-or-later
// The dowels that an experiment has beside those of the landmarks (Experiment::sites): placed,
// given a depth, joined to the network.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_network.h"
#include "problems/pipeline/case.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

// The experiment's tissue as it holds for the landmarks: with the depths of `sites` that are
// landmarks' among set_mm, and without those of set_mm that only inserted dowels take. Throws
// InputError where a depth is in both, or is auto.
TissueOptions WithSiteDepths(const Experiment& experiment, const LandmarkFile& landmarks);

// Adds a dowel for each of experiment.sites that is no landmark, with a note: to dowels_on_bone, or
// to open_dowels where its depth is to be interpolated. One whose depth is not stated has the
// tissue's, as a landmark there would (FillDepths, whose notes come after). `near`: laid on the
// nearest bone; `uv`: on the bone under that point of the generic face, which is brought to the
// subject's dowels. Its role is kLandmark at a site of sites.h, else kInserted. Throws InputError
// for a site that is a landmark already, stands on another dowel, is off the bone, or has no depth
// in a table either.
void InsertDowels(const Experiment& experiment, const SubjectData& data, const MeshQuery& skull,
                  Case& subject);

// Joins the dowels that are at no standard site and in no area of the plan to the network
// (network_insertion.h). Returns a note for each that lies outside it.
std::vector<std::string> JoinNetwork(const NetworkPlan& plan, std::span<const Dowel> dowels,
                                     DowelNetwork& network);

// Gives the open dowels the depth that was interpolated at the nearest point of the shell, on which
// they then stand, and adds them to dowels_on_bone: the fit takes them, the depths do not. One
// where no depth is known is left out, with a note.
void FillOpenDowels(const TriMesh& shell, const DepthField& depth, Case& subject);

}  // namespace semblance
