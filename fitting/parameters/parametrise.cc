// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/parametrise.h"

#include <fmt/format.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "fitting/parameters/map_candidate.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

Parametrisation ParametriseBy(const Scan& points, const AutoParameters&) {
  if (!points.given_uv.empty()) {
    return ParametriseBy(points, GivenParameters{});
  }
  if (points.closure == Closure::kPeriodicU) {
    return ParametriseBy(points, CylinderParameters{});
  }
  std::vector<MapCandidate> planes = PlanesOver(points, {});
  if (MayBeTaken(planes.back(), FoldRule::kRefuse)) {
    return TakePlane(std::move(planes.back()));
  }
  if (!points.triangles.empty()) {
    return ParametriseBy(points, MeshParameters{});
  }
  FailParameters(fmt::format("the points fold over every plane: {}; {}", FaultsText(planes),
                             OtherThanPlane()));
}

void CheckTriangles(const Scan& points) {
  const auto count = static_cast<std::int64_t>(points.positions.size());
  for (const Triangle& t : points.triangles) {
    for (const std::int32_t corner : t) {
      if (corner < 0 || corner >= count) {
        FailParameters(
            fmt::format("a triangle has the corner {}, and there are {} points", corner, count));
      }
    }
  }
}

}  // namespace

Parametrisation Parametrise(const Scan& scan, const Parameters& parameters) {
  if (scan.positions.empty()) {
    FailParameters("there is no point; give some");
  }
  if (!scan.given_uv.empty() && scan.given_uv.size() != scan.positions.size()) {
    FailParameters(fmt::format("{} pairs (u,v) for {} points; give one per point, or none",
                               scan.given_uv.size(), scan.positions.size()));
  }
  CheckTriangles(scan);
  return std::visit([&](const auto& p) { return ParametriseBy(scan, p); }, parameters);
}

Parametrisation Parametrise(std::span<const Vec3> positions, const Parameters& parameters,
                            std::span<const Vec2> given_uv) {
  return Parametrise({.positions = positions, .given_uv = given_uv}, parameters);
}

}  // namespace semblance
