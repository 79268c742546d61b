// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/sphere_parameters.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>

#include "fitting/parameters/principal_frame.h"

namespace semblance {
namespace {

// Of the least and the greatest the one farther from the middle one. What is long or flat is most
// nearly round about it, and takes a quarter fewer vertices than about the others; how near the
// surface comes to the points, also at the poles, differs little.
Vec3 OddAxisOf(const PrincipalFrame& principal) {
  const Vec3& s = principal.spreads;
  return principal.axes.col(s[2] * s[0] >= s[1] * s[1] ? 2 : 0);
}

PolarSphere SphereFor(const SphereParameters& asked, std::span<const Vec3> points,
                      const PrincipalFrame& principal) {
  const Vec3 axis(asked.axis[0], asked.axis[1], asked.axis[2]);
  if (!axis.allFinite()) {
    FailParameters("the sphere's axis is not finite; give three numbers");
  }
  PolarSphere sphere = SphereThrough(points, axis.isZero(0) ? OddAxisOf(principal) : axis);
  if (!sphere.centre.allFinite() || !(sphere.radius_mm > 0)) {
    FailParameters(
        "no sphere goes near the points, which lie on a plane or in one place; give u and v");
  }
  return sphere;
}

// Why the points are no sphere; empty if they go all round.
std::string HoleFault(const PolarSphere& sphere, std::span<const Vec3> points, const Mat3& axes) {
  constexpr double kMostWidth = 0.8;  // of a cap of 45 degrees; of a tube with open ends 1
  const EmptyRay ray = WidestRay(
      sphere, points, std::array<Vec3, 4>{axes.col(0), axes.col(1), axes.col(2), sphere.axis});
  if (ray.Width() <= kMostWidth) {
    return "";
  }
  const std::string nearest = std::isfinite(ray.nearest_mm)
                                  ? fmt::format("no point is nearer than {:.3g} mm", ray.nearest_mm)
                                  : "no point lies on that side";
  return fmt::format(
      "the points do not go all round the centre of the sphere, [{:.4g}, {:.4g}, {:.4g}] mm: to "
      "the ray along [{:.2g}, {:.2g}, {:.2g}] {}, half of all are within {:.3g} mm of its line; "
      "take plane for an open surface, cylinder for a tube, or mesh, or give u and v",
      sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), ray.direction.x(), ray.direction.y(),
      ray.direction.z(), nearest, ray.usual_mm);
}

MapCandidate OnSphere(const PolarSphere& sphere, std::vector<Vec2> angles) {
  const double half_round_mm = std::numbers::pi * sphere.radius_mm;
  MapCandidate over{
      .how = fmt::format("the sphere along [{:.3g}, {:.3g}, {:.3g}] about "
                         "[{:.4g}, {:.4g}, {:.4g}] of radius {:.4g} mm",
                         sphere.axis.x(), sphere.axis.y(), sphere.axis.z(), sphere.centre.x(),
                         sphere.centre.y(), sphere.centre.z(), sphere.radius_mm),
      .at = std::move(angles),
      .period_mm = Vec2(2 * half_round_mm, 0)};
  for (Vec2& p : over.at) {
    p = p.cwiseProduct(Vec2(2 * half_round_mm, half_round_mm));
  }
  return over;
}

}  // namespace

TriedSphere TrySphere(const Scan& points, const SphereParameters& asked) {
  const PrincipalFrame principal = PrincipalFrameOf(points.positions);
  TriedSphere tried{.sphere = SphereFor(asked, points.positions, principal),
                    .angles = {},
                    .over = {},
                    .fault = {}};
  tried.fault = HoleFault(tried.sphere, points.positions, principal.axes);
  if (!tried.fault.empty()) {
    return tried;
  }
  tried.angles = AnglesAbout(tried.sphere, points.positions);
  tried.over = OnSphere(tried.sphere, tried.angles);
  tried.over.faults = MapFaultsOf(points, tried.over);
  if (!MayBeTaken(tried.over, asked.folds)) {
    tried.fault = fmt::format(
        "the points fold over the sphere, for rays from its centre meet them more than once: {}; "
        "if triangles close them, take parameters: mesh, else give u and v; or write folds: accept",
        FaultsText({tried.over}));
  }
  return tried;
}

Parametrisation TakeSphere(const Scan& points, TriedSphere tried) {
  Poles poles = PolesOf(tried.sphere, points.positions, tried.angles);
  if (tried.over.faults.mirrored) {
    for (Vec2& p : tried.angles) {
      p.y() = 1 - p.y();
    }
    std::swap(poles[0], poles[1]);
  }
  return {.uv = std::move(tried.angles),
          .source = ParameterSource::kSphere,
          .how = std::move(tried.over.how),
          .faults = tried.over.faults,
          .poles = poles};
}

Parametrisation ParametriseBy(const Scan& points, const SphereParameters& asked) {
  TriedSphere tried = TrySphere(points, asked);
  if (!tried.fault.empty()) {
    FailParameters(tried.fault);
  }
  return TakeSphere(points, std::move(tried));
}

}  // namespace semblance
