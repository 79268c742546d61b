// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/metrics/identification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fitting/problem/placement.h"
#include "problems/experiment/metrics/protocols.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {
namespace {

double OrLargest(double distance_mm) {
  return std::isfinite(distance_mm) ? distance_mm : std::numeric_limits<double>::infinity();
}

// The points that both faces have, in the same order.
struct CommonPoints {
  std::vector<Vec3> of_probe, of_known;
};

CommonPoints Common(const ProbeFace& probe, const KnownFace& known) {
  CommonPoints common;
  for (const auto& [site, point] : probe.points) {
    const auto other = std::ranges::find(known.points, site, &std::pair<std::string, Vec3>::first);
    if (other != known.points.end()) {
      common.of_probe.push_back(point);
      common.of_known.push_back(other->second);
    }
  }
  if (common.of_probe.size() < 3) {
    throw InputError(fmt::format(
        "identification: {} has {} landmarks in common with the face that is asked about, and at "
        "least 3 are needed; give it more",
        known.name, common.of_probe.size()));
  }
  return common;
}

double Rms_mm(const CommonPoints& common, const Similarity& known_from_probe) {
  double squares = 0;
  for (std::size_t k = 0; k < common.of_probe.size(); ++k) {
    squares += (known_from_probe * common.of_probe[k] - common.of_known[k]).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(common.of_probe.size()));
}

}  // namespace

double FindRank(std::span<const double> distances_mm, std::size_t own) {
  const double mine = OrLargest(distances_mm[own]);
  double closer = 0, equal = 0;
  for (std::size_t k = 0; k < distances_mm.size(); ++k) {
    closer += OrLargest(distances_mm[k]) < mine;
    equal += k != own && OrLargest(distances_mm[k]) == mine;
  }
  return 1 + closer + equal / 2;
}

std::vector<double> CumulativeMatch(std::span<const double> ranks, int gallery) {
  std::vector<double> shares;
  for (int k = 1; k <= gallery; ++k) {
    const auto within = std::ranges::count_if(ranks, [k](double r) { return r <= k; });
    shares.push_back(
        ranks.empty() ? kNaN : static_cast<double>(within) / static_cast<double>(ranks.size()));
  }
  return shares;
}

FaceDistance MeasureFaceDistance(const ProbeFace& probe, const KnownFace& known,
                                 const RunContext& context) {
  const CommonPoints common = Common(probe, known);
  const Similarity known_from_probe =
      PlaceTemplate(common.of_probe, common.of_known, {}, {.rotate = true, .scale = false});
  const BestFitScore fit =
      ScoreBestFit(known.skin, known.region, Transformed(probe.mesh, known_from_probe), context);
  return {.surface_mm = fit.truth_to_face.rms_mm, .landmarks_mm = Rms_mm(common, known_from_probe)};
}

ProbeFace SimulateRescan(const KnownFace& known, double cell_mm, double noise_mm,
                         std::uint64_t random_seed) {
  Random random(random_seed);
  ProbeFace again{.mesh = ClusterVertices(known.skin, cell_mm), .points = known.points};
  const std::vector<Vec3> normals = VertexNormals(again.mesh);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    again.mesh.points[v] += noise_mm * random.Normal() * normals[v];
  }
  for (auto& [site, point] : again.points) {
    point += noise_mm * Vec3(random.Normal(), random.Normal(), random.Normal()) / std::sqrt(3.0);
  }
  return again;
}

}  // namespace semblance::problems
