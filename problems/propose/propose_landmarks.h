// SPDX-License-Identifier: GPL-3.0-or-later
// Where the sites may lie on a skull that nobody has marked: a proposal, for a person to correct.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "problems/propose/reference_head.h"
#include "problems/propose/skull_pose.h"
#include "problems/subject/landmarks.h"
#include "surfaces/base/run_context.h"

namespace semblance {

struct ProposedSite {
  std::string site;
  Vec3 point = Vec3::Constant(kNaN);      // on the skull, mm
  Vec3 predicted = Vec3::Constant(kNaN);  // by the median of the references, before the rule
  int references = 0;                     // heads that have the site; mirror images are not counted
  double agreement_mm = kNaN;             // rms of the references' sites from their median
  double piece_misfit_mm = kNaN;  // of the bone around it after the warp, median of references
  double from_bone_mm = kNaN;     // of the predicted point
  double sharpness_mm = kNaN;     // of the rule's extremum (site_rules.h)
  // Root mean square; the root of the sum of the squares of the references' own error and of their
  // disagreement, as those of a mean, of misfit, distance and half the sharpness.
  double expected_error_mm = kNaN;
  double confidence = kNaN;  // chance that it is off by 3 mm or less, if its error is
                             // normal, alike in all directions
};

struct Proposal {
  std::vector<ProposedSite> sites;     // in the order of StandardSites()
  std::vector<AbsentLandmark> absent;  // no bone within 8 mm of where it is predicted
  SkullPose pose;                      // of the first reference whose shape says how it lies
  Similarity skull_from_average;       // by the proposed sites
  std::string axes = "LPS";            // of the skull's file, as the pose says: LPS or RAS
  std::vector<std::string> notes;
};

// The skull's outer shell is laid on a reference's (skull_pose.h), each reference and its
// mirror image is warped onto it (skull_warp.h), the median of what they say is snapped to bone by
// the site's rule (site_rules.h). skull: in mm, in any pose. `name`: for messages. The result does
// not depend on context.threads. Throws InputError if there is no reference, the mesh is no head's
// (mesh_check.h), holds two skulls, or does not say how it lies; if fewer than six sites are found,
// or if sides came out exchanged.
Proposal ProposeLandmarks(const TriMesh& skull, const std::string& name,
                          std::span<const ReferenceHead> references, const RunContext& context);

// As a file to correct, in the frame of the skull's file: `proposed` is set, each certainty and
// note says how sure the site is.
LandmarkFile ProposalFile(const Proposal& proposal, const std::string& subject);

}  // namespace semblance
