// SPDX-License-Identifier: GPL-3.0-or-later
// From a reference's skull to another, beyond size and pose.
#pragma once

#include <string>
#include <vector>

#include "problems/propose/reference_head.h"
#include "surfaces/base/thin_plate.h"

namespace semblance {

// The pose refined by what lies within 30 mm of a site: faces differ from their vaults in size.
Similarity FacePose(const ReferenceHead& reference, const SkullShell& skull,
                    const Similarity& skull_from_reference);

// The thin plate from the reference's frame to the skull's that lays one shell onto the other.
// Round by round points of both, denser within 30 mm of a site, are matched with the closest of the
// other that face alike, those further than a reach are left out, the rest weigh less the further
// they are; the plate, nearly affine at first, becomes softer and the reach shorter.
ThinPlate WarpOnto(const ReferenceHead& reference, const SkullShell& skull,
                   const Similarity& skull_from_reference);

// A reference's site on the skull.
struct WarpedSite {
  std::string site;
  Vec3 point = Vec3::Constant(kNaN);
  double piece_misfit_mm = kNaN;  // mean distance of the bone around it after the fit; NaN where
                                  // too little of it has a match
};

// The sites carried by the plate; then for each the bone within 18 mm of it on the reference, as
// the plate carries it, is laid rigidly onto the skull by trimmed ICP, and takes the site along (by
// 8 mm at most; where it would go further the plate's point stays).
std::vector<WarpedSite> CarrySites(const ReferenceHead& reference, const SkullShell& skull,
                                   const Similarity& skull_from_reference, const ThinPlate& plate);

}  // namespace semblance
