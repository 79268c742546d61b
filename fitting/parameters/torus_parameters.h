// SPDX-License-Identifier: GPL-3.0-or-later
// (u,v) on a torus.
#pragma once

#include <array>
#include <string_view>

#include "fitting/parameters/map_candidate.h"
#include "fitting/parameters/parametrisation.h"
#include "surfaces/base/fields.h"

namespace semblance {

// Angles around an axis and around the ring's circle about it, for points that go round both ways;
// the ring and its tube are those of the torus nearest to the points (torus.h).
struct TorusParameters {
  static constexpr std::string_view kName = "torus";
  std::array<double, 3> axis = {0, 0, 0};  // that u goes round; 0: found from the points
  FoldRule folds = FoldRule::kRefuse;      // of points that lie over each other
};
template <class Visitor>
void Fields(Visitor& visit, TorusParameters& o) {
  visit(FieldInfo{.name = "axis",
                  .doc = "direction that u goes round; [0, 0, 0] takes that of the torus nearest "
                         "to the points"},
        o.axis);
  FoldField(visit, o.folds);
}

// Throws InputError for an axis that is not finite, points that are no torus, and points that fold
// over it.
Parametrisation ParametriseBy(const Scan& points, const TorusParameters& asked);

}  // namespace semblance
