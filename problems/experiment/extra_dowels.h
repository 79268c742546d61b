// SPDX-License-Identifier: GPL-3.0-or-later
// The dowels of an experiment in addition to those of the landmarks (Experiment::sites): their
// places, their depths, and their areas in the network.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "interp/dowels/dowel_network.h"
#include "problems/experiment/case.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {

// The experiment's tissue options for the landmarks. set_mm has the depths of those `sites` that
// are landmarks, and lacks the entries that only inserted dowels use. Throws InputError if a depth
// appears in both or is auto.
TissueOptions WithSiteDepths(const Experiment& experiment, const LandmarkFile& landmarks);

// Adds a dowel, with a note, for each of experiment.sites that is no landmark: to dowels_on_bone,
// or to open_dowels if its depth is to be interpolated. Without a stated depth it gets the tissue's
// depth, as a landmark at this site would (FillDepths, whose notes follow). `near` places it on the
// nearest bone. `uv` places it on the bone under that point of the generic face, which is brought
// to the subject's dowels. The role is kLandmark at a site of sites.h, else kInserted. Throws
// InputError for a site that is a landmark already, lies on another dowel or off the bone, or has
// no depth in a table either.
void InsertDowels(const Experiment& experiment, const SubjectData& data, const MeshQuery& skull,
                  Case& subject);

// Adds dowels at the sites of options.landmarks.carried, with one note for those with a depth of
// their own, and one for those whose depth is to be interpolated. If it adds none, as on a
// phantom's skull or where people's mean bone cannot be laid on the skull, a note states why.
void InsertCarriedDowels(const Experiment& experiment, const SubjectData& data,
                         const MeshQuery& skull, const RunContext& context, Case& subject);

// Joins the dowels that are at no standard site and in no area of the plan to the network
// (network_insertion.h). Returns a note for each dowel outside the network.
std::vector<std::string> JoinNetwork(const NetworkPlan& plan, std::span<const Dowel> dowels,
                                     DowelNetwork& network);

// Gives the open dowels the depth that was interpolated at the nearest point of the shell, moves
// them there, and adds them to dowels_on_bone. So the fit uses them, but no depth depends on them.
// A dowel without an interpolated depth is left out, with a note.
void FillOpenDowels(const TriMesh& shell, const DepthField& depth, Case& subject);

}  // namespace semblance::problems
