// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) of a mesh laid out on the plane.
#pragma once

#include <string_view>

#include "fitting/parameters/mesh_map.h"
#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"

namespace semblance {

// The triangles between the points, laid out on the plane (mesh_map.h), u and v along its sides.
struct MeshParameters {
  static constexpr std::string_view kName = "mesh";
  MeshMap map = MeshMap::kLscm;  // of the triangles to the plane
};
template <class Visitor>
void Fields(Visitor& visit, MeshParameters& o) {
  visit(FieldInfo{.name = "map",
                  .doc = "lscm: angles kept, with a free border; arap: as rigid as possible, with "
                         "a free border, slow; mean_value: the border on a square, which never "
                         "folds; tutte: the same with uniform weights; auto: arap, or mean_value "
                         "where that folds"},
        o.map);
}

// Throws InputError as LayOut does, where the map folds, and without triangles.
Parametrisation ParametriseBy(const Scan& points, const MeshParameters& mesh);

}  // namespace semblance
