// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/parametrise.h"

#include <fmt/format.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "fitting/closed_mesh/closed_map.h"
#include "fitting/parameters/map_candidate.h"

namespace semblance {
namespace {

// By rays where they meet it once, for that needs no triangles to be right.
Parametrisation SphereOrMesh(const Scan& points) {
  TriedSphere sphere = TrySphere(points, {});
  return sphere.fault.empty() ? TakeSphere(points, std::move(sphere))
                              : ParametriseBy(points, MeshParameters{});
}

// What ends in tips may be a sphere; a tube that is cut aslant is none, and stays a cylinder.
Parametrisation CylinderOrSphere(const Scan& points) {
  const TriedCylinder cylinder = TryCylinders(points, {});
  if (cylinder.ends_in_tips) {
    if (TriedSphere sphere = TrySphere(points, {}); sphere.fault.empty()) {
      return TakeSphere(points, std::move(sphere));
    }
  }
  if (!cylinder.end_fault.empty()) {
    FailParameters(cylinder.end_fault);
  }
  return TakeCylinder(points, cylinder);
}

Parametrisation ParametriseBy(const Scan& points, const AutoParameters&) {
  if (!points.given_uv.empty()) {
    return ParametriseBy(points, GivenParameters{});
  }
  if (points.closure == Closure::kPeriodicUv) {
    return ParametriseBy(points, TorusParameters{});
  }
  if (points.closure == Closure::kPeriodicU) {
    return IsClosed(points.triangles) ? SphereOrMesh(points) : CylinderOrSphere(points);
  }
  std::vector<MapCandidate> planes = PlanesOver(points, {});
  if (MayBeTaken(planes.back(), FoldRule::kRefuse)) {
    return TakePlane(std::move(planes.back()));
  }
  if (!points.triangles.empty()) {
    return ParametriseBy(points, MeshParameters{});
  }
  PointLayout layout = LayOutPoints(points.positions, MeshParameters{}.map);
  if (!layout.fault.empty()) {
    FailParameters(fmt::format(
        "the points fold over every plane: {}; and triangles between them make no open sheet: {}",
        FaultsText(planes), layout.fault));
  }
  return FromLayout(std::move(layout));
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
