// SPDX-License-Identifier: GPL-3.0-or-later
// Warps a reference's skull onto another skull, beyond size and pose, and carries its sites along.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/subject/propose/reference_head.h"
#include "surfaces/base/thin_plate.h"

namespace semblance::problems {

// Refines the pose by the bone within 30 mm of a site, because face and vault differ in size
// independently.
Similarity FacePose(const ReferenceHead& reference, const SkullShell& skull,
                    const Similarity& skull_from_reference);

// Fits the thin plate from the reference's frame to the skull's that lays one shell onto the other.
// In each round, points of both shells, denser within 30 mm of a site, are matched with the closest
// points of the other that face alike. Matches beyond a reach are dropped; the others weigh less
// the farther they are. The plate is nearly affine at first and becomes softer, while the reach
// becomes shorter. `known`: sites of the skull that a person has placed. In every round, the
// reference's sites are matched with them too.
ThinPlate WarpOnto(const ReferenceHead& reference, const SkullShell& skull,
                   const Similarity& skull_from_reference, std::span<const SitePoint> known = {});

// A reference's site carried to the skull.
struct WarpedSite {
  std::string site;
  Vec3 point = Vec3::Constant(kNaN);
  double piece_misfit_mm = kNaN;  // mean distance of the bone around it after the fit; NaN if too
                                  // little of it has a match
};

// Carries the sites by the plate. Then, for each site, the reference's bone within 18 mm of it, as
// the plate carries it, is aligned rigidly with the skull by trimmed ICP and takes the site along.
// If that would move the site by more than 8 mm, the plate's point stays.
std::vector<WarpedSite> CarrySites(const ReferenceHead& reference, const SkullShell& skull,
                                   const Similarity& skull_from_reference, const ThinPlate& plate);

}  // namespace semblance::problems
