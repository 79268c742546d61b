// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) in [0,1] x [0,1] for scattered points.
#pragma once

#include <span>
#include <string_view>
#include <variant>

#include "fitting/parameters/cylinder_parameters.h"
#include "fitting/parameters/given_parameters.h"
#include "fitting/parameters/mesh_parameters.h"
#include "fitting/parameters/parametrisation.h"
#include "fitting/parameters/plane_parameters.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// The parameters that are given, if there are any; otherwise those of a cylinder for a surface that
// goes round in u, and of a plane for an open one. Where every plane folds the mesh is laid out.
struct AutoParameters {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoParameters&) {}

using Parameters = std::variant<AutoParameters, GivenParameters, PlaneParameters,
                                CylinderParameters, MeshParameters>;

// du x dv looks where the triangles look. Whatever is chosen is one-to-one, but for given (u,v) and
// where folds are accepted: the points are looked at (one_to_one.h), and the triangles if there are
// any. Throws InputError for no points, `given` without given_uv, a number of given_uv that is not
// that of the points, an empty range, given_uv outside of it, points that span no plane or have no
// extent along the axis, close at an end of the cylinder, or fold over every plane or cylinder that
// may be taken, a mesh without triangles, a corner that is no point, and as LayOut.
Parametrisation Parametrise(const Scan& scan, const Parameters& parameters = AutoParameters{});
Parametrisation Parametrise(std::span<const Vec3> positions,
                            const Parameters& parameters = AutoParameters{},
                            std::span<const Vec2> given_uv = {});

}  // namespace semblance
