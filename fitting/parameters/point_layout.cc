// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/point_layout.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "fitting/parameters/map_candidate.h"
#include "fitting/triangulation/even_points.h"
#include "fitting/triangulation/point_sheet.h"
#include "fitting/triangulation/sheet_places.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

std::size_t CountFarOff(const TriMesh& mesh, const SheetPlaces& places) {
  constexpr double kFar = 3;  // edges
  const double edge_mm = std::sqrt(Area(mesh) / static_cast<double>(mesh.points.size()));
  std::size_t far_off = 0;
  for (const double distance_mm : places.distance_mm) {
    far_off += distance_mm > kFar * edge_mm ? 1 : 0;
  }
  return far_off;
}

PointLayout LayOutSheet(const TriMesh& mesh, MeshMap map, std::span<const Vec3> points) {
  const MeshLayout layout = LayOut(mesh, map);
  SheetPlaces places = PlacesOnSheet(mesh, layout.at, points);
  PointLayout result{.at = std::move(places.at), .map = layout.map};
  result.faults = FaultsOfPoints({.positions = points, .at = result.at});
  result.corners = mesh.points.size();
  result.far_off = CountFarOff(mesh, places);
  return result;
}

// What cannot be laid out may be so with fewer corners.
PointLayout TryLayOut(const EvenPoints& even, MeshMap map, std::span<const Vec3> points) {
  const PointSheet sheet = SheetBetween(even);
  if (!sheet.fault.empty()) {
    return {.fault = sheet.fault};
  }
  PointLayout layout;
  try {
    layout = LayOutSheet(sheet.mesh, map, points);
  } catch (const InputError& error) {
    return {.fault = error.what()};
  }
  if (layout.faults.folded > kMostFaults) {
    layout.fault =
        fmt::format("laid out by {}, {} of it fold; take another map (mean_value does not fold)",
                    EnumNames(layout.map)[static_cast<std::size_t>(layout.map)],
                    PercentText(layout.faults.folded));
  }
  return layout;
}

void CheckFinite(std::span<const Vec3> points) {
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!points[k].allFinite()) {
      FailParameters(fmt::format("point {} is not finite; leave it out", k + 1));
    }
  }
}

}  // namespace

PointLayout LayOutPoints(std::span<const Vec3> points, MeshMap map) {
  constexpr double kThickest = 0.45;
  CheckFinite(points);
  PointLayout first_fault;
  for (const int per_place : {6, 12, 24, 48}) {
    const EvenPoints even = EvenlySpread(points, per_place);
    if (even.thickness > kThickest) {
      continue;
    }
    PointLayout layout = TryLayOut(even, map, points);
    if (layout.fault.empty()) {
      return layout;
    }
    if (first_fault.fault.empty()) {
      first_fault.fault = std::move(layout.fault);
    }
  }
  if (first_fault.fault.empty()) {
    first_fault.fault = "they fill space, or their noise is as wide as what they show";
  }
  return first_fault;
}

}  // namespace semblance
