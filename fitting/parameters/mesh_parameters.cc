// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/mesh_parameters.h"

#include <fmt/format.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fitting/parameters/map_candidate.h"

namespace semblance {
namespace {

std::string_view NameOfMap(MeshMap map) { return EnumNames(map)[static_cast<std::size_t>(map)]; }

TriMesh MeshOf(const Scan& points) {
  return {.points = {points.positions.begin(), points.positions.end()},
          .triangles = {points.triangles.begin(), points.triangles.end()}};
}

Parametrisation FromPlaces(MapCandidate laid) {
  Parametrisation result{.uv = std::move(laid.at),
                         .source = ParameterSource::kMesh,
                         .how = std::move(laid.how),
                         .faults = laid.faults};
  Normalise(0, "the mesh's u", result.uv);
  Normalise(1, "the mesh's v", result.uv);
  return result;
}

}  // namespace

Parametrisation ParametriseBy(const Scan& points, const MeshParameters& mesh) {
  if (points.triangles.empty()) {
    FailParameters(
        "type 'mesh' needs triangles between the points; give a PLY, OBJ, STL or OFF with faces "
        "(MeshLab and CloudCompare make them from points), or the columns u and v with parameters: "
        "given");
  }
  MeshLayout layout = LayOut(MeshOf(points), mesh.map);
  MapCandidate laid{.how = fmt::format("the mesh laid out by {}", NameOfMap(layout.map)),
                    .at = std::move(layout.at)};
  laid.faults = MapFaultsOf(points, laid);
  if (laid.faults.folded > kMostFaults) {
    FailParameters(fmt::format("{} folds {} of it; take another map (mean_value does not fold)",
                               laid.how, PercentText(laid.faults.folded)));
  }
  return FromPlaces(std::move(laid));
}

}  // namespace semblance
