// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/relaxation/relaxation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fitting/relaxation/relaxer.h"

namespace semblance {

double SharpestCrease_deg(const HSplineSurface& surface, const DowelMesh& mesh,
                          std::span<const Vec2> uv) {
  std::vector<Vec3> normals;
  for (const Vec2& place : uv) {
    normals.push_back(surface.Normal(place));
  }
  double cosine = 1;
  for (const auto& [a, b] : mesh.edges()) {
    cosine = std::min(cosine, normals[a].dot(normals[b]));
  }
  return std::acos(std::max(cosine, -1.0)) * 180 / std::numbers::pi;
}

RelaxationSummary Relax(const HSplineSurface& surface, const HSplineSurface& rest,
                        const DowelMesh& mesh, const RelaxationOptions& options, int rounds,
                        FitTarget& target) {
  Relaxer relaxer(surface, rest, mesh, options, target);
  RelaxationSummary summary{.before = relaxer.Penalties(), .after = {}};
  for (int round = 0; round < rounds; ++round) {
    relaxer.Round(summary);
  }
  summary.after = relaxer.Penalties();
  MovePoints(surface, relaxer.uv(), target, summary);
  return summary;
}

}  // namespace semblance
