// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) that the points bring with them.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance {

// Those that are given, with the ranges mapped to [0,1].
struct GivenParameters {
  static constexpr std::string_view kName = "given";
  std::array<double, 2> u_range = {0, 1};  // what becomes 0 and 1
  std::array<double, 2> v_range = {0, 1};  // likewise
};
template <class Visitor>
void Fields(Visitor& visit, GivenParameters& o) {
  visit(FieldInfo{.name = "u_range", .doc = "what of the column u becomes 0 and 1"}, o.u_range);
  visit(FieldInfo{.name = "v_range", .doc = "what of the column v becomes 0 and 1"}, o.v_range);
}

// `given` in the memory of the (u,v). Throws InputError as Parametrise does.
Parametrisation TakeGiven(std::vector<Vec2> given_uv, const GivenParameters& given,
                          const PointNames& name_of = {});

// Throws InputError without given_uv, and as TakeGiven.
Parametrisation ParametriseBy(const Scan& points, const GivenParameters& given);

}  // namespace semblance
