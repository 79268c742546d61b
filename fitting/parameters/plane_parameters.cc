// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/plane_parameters.h"

#include <fmt/format.h>

#include <span>
#include <string>
#include <utility>

#include "fitting/parameters/principal_frame.h"

namespace semblance {
namespace {

// Directions of u and v, unit.
using PlaneAxes = std::array<Vec3, 2>;

PlaneAxes LeastSquaresPlane(std::span<const Vec3> positions) {
  constexpr double kRoundingShare = 1e-14;  // of mean squares; a slanted line comes to 1e-16
  const PrincipalFrame principal = PrincipalFrameOf(positions);
  if (!(principal.spreads[1] > kRoundingShare * principal.spreads[2])) {
    FailParameters("the points lie on a line and span no plane; give (u,v), or other points");
  }
  return {principal.axes.col(2), principal.axes.col(1)};
}

PlaneAxes PlaneAcross(const Vec3& normal) {
  if (!normal.allFinite()) {
    FailParameters("the plane's normal is not finite; give three numbers");
  }
  const Vec3 unit = normal.normalized();
  Eigen::Index flattest = 0;
  unit.cwiseAbs().minCoeff(&flattest);
  const Vec3 axis = Vec3::Unit(flattest), u = (axis - axis.dot(unit) * unit).normalized();
  return {u, unit.cross(u)};
}

MapCandidate OnPlane(std::span<const Vec3> positions, const PlaneAxes& axes, std::string how) {
  const Vec3 mean = MeanPoint(positions);
  MapCandidate plane{.how = std::move(how), .at = {}};
  plane.at.reserve(positions.size());
  for (const Vec3& p : positions) {
    plane.at.emplace_back((p - mean).dot(axes[0]), (p - mean).dot(axes[1]));
  }
  return plane;
}

}  // namespace

std::vector<MapCandidate> PlanesOver(const Scan& points, const PlaneParameters& plane) {
  const Vec3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
  if (!normal.isZero(0)) {
    return ChooseCandidate(points, 1, [&](int) {
      return OnPlane(
          points.positions, PlaneAcross(normal),
          fmt::format("the plane across [{}, {}, {}]", normal.x(), normal.y(), normal.z()));
    });
  }
  return ChooseCandidate(points, 4, [&](int k) {
    return k == 0 ? OnPlane(points.positions, LeastSquaresPlane(points.positions),
                            "the plane of least squares")
                  : OnPlane(points.positions, PlaneAcross(Vec3::Unit(3 - k)),
                            fmt::format("the plane across {}", "xyz"[3 - k]));
  });
}

Parametrisation TakePlane(MapCandidate plane) {
  TurnToTriangles(plane.faults, 1, plane.at);
  Parametrisation result{.uv = std::move(plane.at),
                         .source = ParameterSource::kPlane,
                         .how = std::move(plane.how),
                         .faults = plane.faults};
  Normalise(0, "the plane's u", result.uv);
  Normalise(1, "the plane's v", result.uv);
  return result;
}

std::string OtherThanPlane() {
  return "give the columns u and v, or triangles between the points (a PLY, OBJ, STL or OFF with "
         "faces) with parameters: mesh, or, for a tube, parameters: cylinder with closure: "
         "periodic_u";
}

Parametrisation ParametriseBy(const Scan& points, const PlaneParameters& plane) {
  std::vector<MapCandidate> planes = PlanesOver(points, plane);
  if (!MayBeTaken(planes.back(), plane.folds)) {
    FailParameters(fmt::format("the points fold over the plane: {}; {}; or write folds: accept",
                               FaultsText(planes), OtherThanPlane()));
  }
  return TakePlane(std::move(planes.back()));
}

}  // namespace semblance
