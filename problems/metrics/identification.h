// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a face is recognised: the rank of the right person in a gallery.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "problems/metrics/face_region.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// The place of `own` when the gallery is sorted by its distances: 1 + those that are closer + half
// of the others that are as close, so that a gallery of equals gives the mean rank. A distance that
// is not finite counts as the largest. distances_mm: one per person; own: an index of it.
double RankOf(std::span<const double> distances_mm, std::size_t own);

// The cumulative match characteristic (Phillips et al. 2000): at [k - 1] the share of ranks that do
// not exceed k, for k = 1 ... gallery. Ranks are in 1 ... gallery, so the last is 1; none: all NaN.
std::vector<double> CumulativeMatch(std::span<const double> ranks, int gallery);

// The mean rank by chance.
inline double ChanceRank(int gallery) { return (gallery + 1) / 2.0; }

// Points of the skin in front of landmarks.
using SkinPoints = std::vector<std::pair<std::string, Vec3>>;  // by site

// A face that is asked about.
struct ProbeFace {
  TriMesh mesh;
  SkinPoints points;
};

// A person of the gallery.
struct KnownFace {
  std::string name;
  TriMesh skin;
  FaceRegion region;  // of the skin: what is compared
  SkinPoints points;
};

struct FaceDistance {
  double surface_mm = kNaN;    // rms over the region, after the rigid motion that lies best
  double landmarks_mm = kNaN;  // rms of the points that both have, after a rigid motion of them
};

// Size is kept: it tells people apart. The surface is first brought to the person by the points,
// then by ScoreBestFit (protocols.h). Throws InputError if the two have fewer than three points in
// common, or nothing of the skin is scored.
FaceDistance DistanceOf(const ProbeFace& probe, const KnownFace& known, const RunContext& context);

// The true face as another scan would show it: vertices clustered in cells of cell_mm (> 0), then
// each moved at random along its normal, noise_mm (>= 0) rms. The points move likewise.
ProbeFace SeenAgain(const KnownFace& known, double cell_mm, double noise_mm,
                    std::uint64_t random_seed);

}  // namespace semblance
