// SPDX-License-Identifier: GPL-3.0-or-later
// Notes on points that were left out, or that look doubtful.
#pragma once

#include <string>
#include <vector>

#include "problems/points/place_points.h"
#include "problems/points/points_out.h"

namespace semblance::problems {

// States in a sentence each which points were left out of the table, and what looks doubtful.
std::vector<std::string> FindNotes(const PointTable& table, const PointsOut& out,
                                   const PreparedPoints& placed, const PointFitOptions& options);

}  // namespace semblance::problems
