// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) of a mesh laid out on the plane, or, if it is closed, on the sphere.
#pragma once

#include <string_view>

#include "fitting/parameters/mesh_map.h"
#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"

namespace semblance {

// The triangles between the points, laid out on the plane (mesh_map.h), u and v along its sides;
// or, of a surface that is to go round in u, on the sphere (closed_map.h), u the azimuth and v the
// angle from a pole over pi.
struct MeshParameters {
  static constexpr std::string_view kName = "mesh";
  MeshMap map = MeshMap::kLscm;  // of the triangles to the plane; there is one to the sphere
};
template <class Visitor>
void Fields(Visitor& visit, MeshParameters& o) {
  visit(
      FieldInfo{.name = "map",
                .doc =
                    "lscm: angles kept, with a free border; arap: as rigid as possible, with "
                    "a free border, slow; mean_value: the border on a square, which never "
                    "folds; tutte: the same with uniform weights; auto: arap, or mean_value "
                    "where that folds. It does not say how a closed mesh is laid out on the sphere "
                    "(closure: periodic_u)"},
      o.map);
}

// Throws InputError as LayOut or LayOutOnSphere does, where the map folds, and without triangles.
Parametrisation ParametriseBy(const Scan& points, const MeshParameters& mesh);

}  // namespace semblance
