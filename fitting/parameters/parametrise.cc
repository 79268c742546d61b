// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/parametrise.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "fitting/closed_mesh/closed_map.h"
#include "fitting/parameters/map_candidate.h"
#include "fitting/parameters/one_to_one.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

// (u,v) as a place on the unit sphere, or on the plane.
Vec3 PlaceOf(const Parametrisation& map, const Vec2& uv) {
  if (!map.poles) {
    return {uv.x(), uv.y(), 0};
  }
  const double turn = 2 * std::numbers::pi * uv.x(), from_pole = std::numbers::pi * uv.y();
  return {std::sin(from_pole) * std::cos(turn), std::sin(from_pole) * std::sin(turn),
          -std::cos(from_pole)};
}

double SqueezedBy(const Parametrisation& map, const Scan& points) {
  std::vector<double> on_map;
  on_map.reserve(points.triangles.size());
  for (const Triangle& t : points.triangles) {
    const Vec3 a = PlaceOf(map, map.uv[t[0]]), b = PlaceOf(map, map.uv[t[1]]),
               c = PlaceOf(map, map.uv[t[2]]), outwards = map.poles ? a : Vec3::UnitZ();
    on_map.push_back(outwards.dot((b - a).cross(c - a)) / 2);
  }
  return SqueezedShare(points.positions, points.triangles, on_map);
}

// A plane, or a sphere about a centre, may leave little room for some of the surface, or fold where
// the check lets it. The triangles are then laid out, and whichever of the two squeezes less is
// taken. Most surfaces are not squeezed, and need no layout, which takes longer.
Parametrisation LessSqueezed(const Scan& points, Parametrisation simple) {
  constexpr double kLittle = 1e-3;  // of the area
  const double squeezed = SqueezedBy(simple, points);
  if (squeezed <= kLittle) {
    return simple;
  }
  try {
    Parametrisation laid = ParametriseBy(points, MeshParameters{});
    return SqueezedBy(laid, points) < squeezed ? std::move(laid) : std::move(simple);
  } catch (const InputError&) {
    return simple;  // triangles that cannot be laid out are not needed for it
  }
}

// By rays where they meet it once and leave room for all of it, for that needs no triangles to be
// right.
Parametrisation SphereOrMesh(const Scan& points) {
  TriedSphere sphere = TrySphere(points, {});
  return sphere.fault.empty() ? LessSqueezed(points, TakeSphere(points, std::move(sphere)))
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
    return LessSqueezed(points, TakePlane(std::move(planes.back())));
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
