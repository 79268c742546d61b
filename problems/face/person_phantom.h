// SPDX-License-Identifier: GPL-3.0-or-later
// A made-up person: a face drawn from the face model, with nose, lips, eyes, ears and neck, over a
// skull at tissue depths drawn from people's. It is no one's head, and everything about it is
// known.
#pragma once

#include <cstdint>
#include <vector>

#include "problems/subject/phantom.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// Tissue over the brain case, from bone to the surface of the skin. Chosen near that of the
// formula's vault and not drawn, because no marker stands there.
inline constexpr double kPersonScalp_mm = 5.5;

struct PersonPhantom {
  // The outer surface of the facial bone and of the front of the brain case, at least 2 mm under
  // the skin; open at crown, back and throat. LPS, mm.
  TriMesh skull;
  TriMesh skin;               // the whole head, closed at the neck; lids and lips are open
  TriMesh closing;            // a closed body that fills the openings of the lids and of the mouth
  std::vector<TriMesh> eyes;  // the eyeballs, the right one first
  // A face is scored against this: the skin, without the walls of those openings, and their
  // closing.
  TriMesh true_skin;
  std::vector<PhantomSite> sites;      // as of Phantom, without doubtful ones; depths to the skin
  Vec3 nasion = Vec3::Constant(kNaN);  // on the skull, also where `sites` lacks it
  double build = kNaN;                 // standard deviations of tissue, over people
};

// Draws a person. The face has the modes of the ICT-FaceKit model with coefficients from N(0,1).
// Independently of the face, depths at the sites come from a distribution of people: means and
// deviations of the T-Table 2023, or of 54 adults (CarriedPeople) at sites that it lacks, one
// number for the build with the loadings of the 54, and a rest that neighbours share. The mean
// skull, with its modes drawn too, is then bent by a thin plate so that its sites lie at these
// depths under the face, and its brain case under the scalp. So the skull and the face differ from
// the means independently between the sites, as people's do from a table, and no method of this
// program has made the truth. The same seed gives the same bytes for any number of threads. Throws
// Cancelled.
PersonPhantom MakePersonPhantom(std::uint64_t random_seed, const RunContext& context);

}  // namespace semblance::problems
