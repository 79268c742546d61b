// SPDX-License-Identifier: GPL-3.0-or-later
// The (u,v) of points, and the shape of level 0 over them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "fitting/parameters/parametrise.h"
#include "fitting/relaxation/foot_moves.h"
#include "problems/experiment/step_clock.h"
#include "problems/points/point_fit_options.h"
#include "problems/points/point_table.h"

namespace semblance::problems {

struct PreparedPoints {
  Parametrisation parameters;
  HSplineShape shape;
  std::optional<FootMoves> moves = {};
};

// Moves (u,v) and triangles out of the table. Throws InputError as Parametrise and MoveToFeet do,
// and for a closure that does not suit the parameters.
//   given: given index of each point, if not all take part.
PreparedPoints PlacePoints(PointTable& table, std::span<const std::uint32_t> given,
                           const PointFitOptions& options, StepClock& step,
                           const RunContext& context);

}  // namespace semblance::problems
