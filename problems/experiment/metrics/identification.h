// SPDX-License-Identifier: GPL-3.0-or-later
// Measures whether a face is recognised: the rank of the right person in a gallery.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "problems/experiment/metrics/face_region.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// The place of `own` in the gallery sorted by distance: 1 + the number of closer persons + half of
// the number of equally close ones, so that a gallery of equals gives the mean rank. A distance
// that is not finite counts as the largest. distances_mm: one per person; own: an index of it.
double FindRank(std::span<const double> distances_mm, std::size_t own);

// The cumulative match characteristic (Phillips et al. 2000): entry [k - 1] is the share of ranks
// that do not exceed k, for k = 1 ... gallery. Ranks lie in 1 ... gallery, so the last entry is 1.
// All NaN without ranks.
std::vector<double> CumulativeMatch(std::span<const double> ranks, int gallery);

// The mean rank by chance.
inline double ChanceRank(int gallery) { return (gallery + 1) / 2.0; }

// Points of the skin in front of landmarks.
using SkinPoints = std::vector<std::pair<std::string, Vec3>>;  // by site

// The face of an unknown person.
struct ProbeFace {
  TriMesh mesh;
  SkinPoints points;
};

// A person of the gallery.
struct KnownFace {
  std::string name;
  TriMesh skin;
  FaceRegion region;  // the part of the skin that is compared
  SkinPoints points;
};

struct FaceDistance {
  double surface_mm = kNaN;    // rms over the region, after the best rigid motion of the surface
  double landmarks_mm = kNaN;  // rms over the common points, after their best rigid motion
};

// The motion keeps the size, because size distinguishes people. The surface is placed by the
// points, then by ScoreBestFit (protocols.h). Throws InputError if the two faces have fewer than
// three common points or if no skin is scored.
FaceDistance MeasureFaceDistance(const ProbeFace& probe, const KnownFace& known,
                                 const RunContext& context);

// Simulates another scan of the true face. Vertices are clustered in cells of cell_mm (> 0). Then
// each vertex moves at random along its normal, by noise_mm (>= 0) rms. The points move at random
// in all directions, by noise_mm rms.
ProbeFace SimulateRescan(const KnownFace& known, double cell_mm, double noise_mm,
                         std::uint64_t random_seed);

}  // namespace semblance::problems
