// SPDX-License-Identifier: GPL-3.0-or-later
// Corrects a generic face by heads whose skin is known: the places of the skull's sites on it, and
// the bias of its mean.
#pragma once

#include <span>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/face/face_prior.h"
#include "problems/face/hspline_prior.h"
#include "problems/face/template_face.h"
#include "surfaces/base/run_context.h"

namespace semblance::problems {

// A head whose skin is known, with measured depths.
struct KnownHead {
  std::vector<Dowel> dowels;
  TriMesh skin;  // outer, of the face alone: without ears, masks and ends of the scan
};

struct RecentreOptions {
  bool move_mean = false;  // false: corrects the sites alone
  double tip_mm = 3;       // a dowel counts only if its tip lies within this of the skin
  double site_prior = 2;   // the present place of a site counts as so many observations
  double mean_prior = 2;   // the present mean counts as so many observations
  double smooth_mm = 6;    // standard deviation of the weights that smooth the shift of the mean
  double gap_mm = 2.5;     // skin counts only within this beside a point's normal ...
  double farthest_mm = 6;  // ... and within this along it
};

struct Recentred {
  TemplateFace face;
  double sites_moved_mm = kNaN;  // median over the sites
  double mean_moved_mm = kNaN;   // RMS over the points with skin in front of them
  double mean_moved_most_mm = kNaN;
};

// Sites: the prior is fitted closely to each head's skin, and the tip of a dowel gives the place of
// its site on the mean. The new place is the mean over heads, both sides and the present place. A
// site without a dowel stays.
// Mean: with these sites the prior's face is estimated from each head's dowels alone. Each point of
// the mean then moves along its normal by the mean distance of the skins from those faces, taken
// over both sides, smoothed and shrunk towards 0. Left and right stay mirror images as far as they
// were. Throws InputError as EstimateShape does.
Recentred Recentre(const FacePrior& prior, const PriorOnTemplate& on_template,
                   const TemplateFace& face, std::span<const KnownHead> heads,
                   const RecentreOptions& options, const RunContext& context);

}  // namespace semblance::problems
