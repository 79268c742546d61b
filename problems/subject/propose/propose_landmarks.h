// SPDX-License-Identifier: GPL-3.0-or-later
// Proposes where the sites lie on a skull without landmarks, for a person to correct, and compares
// a proposal with landmarks that a person placed.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/subject/landmarks.h"
#include "problems/subject/propose/mean_skull.h"
#include "problems/subject/propose/reference_head.h"
#include "problems/subject/propose/skull_pose.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

struct ProposedSite {
  std::string site;
  Vec3 point = Vec3::Constant(kNaN);      // on the skull, mm
  Vec3 direction = Vec3::Constant(kNaN);  // of its depth marker (SuggestedDirection)
  Vec3 predicted = Vec3::Constant(kNaN);  // median of the references, before the rule is applied
  int references = 0;                     // heads that have the site, without mirror images
  int predictions = 0;                    // the same with mirror images
  double agreement_mm = kNaN;  // rms distance of the references' predictions from their median
  double piece_misfit_mm =
      kNaN;                    // of the bone around the site after the warp; median of references
  double from_bone_mm = kNaN;  // distance of the predicted point from bone
  double sharpness_mm = kNaN;  // sharpness of the rule's extremum (site_rules.h)
  // The expected error, root mean square. Its square is the sum of the squares of: the references'
  // own error and their disagreement (both as errors of a mean), the misfit of the piece, the
  // distance from bone, and half the sharpness.
  double expected_error_mm = kNaN;
  // The probability that the error is at most 3 mm, for a normal error without preferred direction.
  double confidence = kNaN;
};

struct Proposal {
  std::vector<ProposedSite> sites;     // in the order of StandardSites()
  std::vector<AbsentLandmark> absent;  // sites without bone within 8 mm of the predicted point
  SkullPose pose;  // without misfits if known points determine it; against the first reference that
                   // gives a clear pose
  Similarity skull_from_average;  // fitted to the proposed sites
  std::string axes = "LPS";       // of the skull's file, concluded from the pose: LPS or RAS
  std::vector<std::string> notes;
};

// Proposes landmarks in four steps: aligns a reference's outer shell with that of the skull
// (skull_pose.h), warps each reference and its mirror image onto the skull (skull_warp.h), takes
// the median of their predictions, and snaps it to bone by the site's rule (site_rules.h). `skull`
// is in mm and in any pose. `name` is for messages. The result does not depend on context.threads.
//
// `known` are sites that a person has placed. Three of them give the pose, so that no search is
// needed, and the warps meet them. They are not proposed again. `lies` narrows the search
// otherwise.
//
// Points that are no good for a face are not proposed (suggestion_check.h). The bone that is met
// first from outside takes their place, if it is within 8 mm of the prediction; otherwise the site
// is absent.
//
// Throws InputError if there is no reference, if the mesh is not a head's (mesh_check.h), if it
// holds two skulls, if its shape does not determine its pose or the known sites do not fit it, if
// fewer than six sites are found, or if the sides came out exchanged.
Proposal ProposeLandmarks(const TriMesh& skull, const std::string& name,
                          std::span<const ReferenceHead> references, const RunContext& context,
                          std::span<const SitePoint> known = {},
                          SkullLies lies = SkullLies::kAnyhow);

// The same with the mean skull as the only reference, which its modes shape like the subject before
// the warp.
Proposal ProposeLandmarks(const TriMesh& skull, const std::string& name, const MeanSkull& mean,
                          const RunContext& context, std::span<const SitePoint> known = {},
                          SkullLies lies = SkullLies::kAnyhow);

// The proposal as a landmark file in the frame of the skull's file. `proposed` is set; each
// landmark has a certainty and a note that explains it.
LandmarkFile ProposalFile(const Proposal& proposal, const std::string& subject);

struct SiteDifference {
  std::string site;
  double error_mm = kNaN;  // NaN if only one of the two files has the site
  Certainty proposed = Certainty::kLow;
  std::string remark;  // the file that lacks the site; empty if both have it
};

struct ProposalComparison {
  std::vector<SiteDifference> sites;  // in the order of the standard sites
  int compared = 0;
  double median_mm = kNaN, most_mm = kNaN;
  double nine_tenths_mm = kNaN;  // 90 % quantile
};

// Both files must be in mm and in the same frame. Throws InputError if they have no site in common.
ProposalComparison CompareProposal(const LandmarkFile& proposal, const LandmarkFile& placed);

// A text for people: a line per site, then a summary.
std::string FormatComparison(const ProposalComparison& comparison);

}  // namespace semblance::problems
