// SPDX-License-Identifier: GPL-3.0-or-later
// A generic face set right by heads whose skin is known: where the sites of the skull meet it, and
// where its mean is off.
#pragma once

#include <span>
#include <vector>

#include "interp/dowels/dowel.h"
#include "problems/face_template/template_face.h"
#include "problems/prior/face_prior.h"
#include "problems/prior/prior_surface.h"
#include "surfaces/base/run_context.h"

namespace semblance {

// A head whose skin is known, with measured depths.
struct KnownHead {
  std::vector<Dowel> dowels;
  TriMesh skin;  // outer, of the face alone: without ears, masks and ends of the scan
};

struct RecentreOptions {
  bool move_mean = false;  // else the sites alone
  double tip_mm = 3;       // a dowel with its tip farther from the skin says nothing of its site
  double site_prior = 2;   // how many points the present place of a site counts as
  double mean_prior = 2;   // how many points the present mean counts as
  double smooth_mm = 6;    // of the shift of the mean: standard deviation of the weights
  double gap_mm = 2.5;     // a skin farther beside a point's normal says nothing of it
  double farthest_mm = 6;  // nor one farther along it
};

struct Recentred {
  TemplateFace face;
  double sites_moved_mm = kNaN;  // median over the sites
  double mean_moved_mm = kNaN;   // RMS over the points that a skin was seen before
  double mean_moved_most_mm = kNaN;
};

// Sites: the prior is fitted to each head's skin, closely, and a dowel's tip gives the place of its
// site on the mean; a site's place is the mean over heads, both sides and the present place. Those
// without a landmark stay. Mean: with these sites the prior's face is estimated from each head's
// dowels alone; a point of the mean then moves along its normal by what the skins are off there in
// the mean, of both sides, smoothed and drawn to 0. Left and right stay mirror images as far as
// they were. Throws InputError as EstimateShape.
Recentred Recentre(const FacePrior& prior, const PriorOnTemplate& on_template,
                   const TemplateFace& face, std::span<const KnownHead> heads,
                   const RecentreOptions& options, const RunContext& context);

}  // namespace semblance
