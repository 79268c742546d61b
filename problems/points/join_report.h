// SPDX-License-Identifier: GPL-3.0-or-later
// How well an edge continues another surface, in numbers, in words and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "problems/points/surface_join.h"

namespace semblance {

// Over 1,000 places of the edge at which it is not held (MeetingsAlong).
struct JoinReport {
  SurfaceJoin join;
  std::string sha256;               // of the given surface's file
  int places = -1;                  // at which the edge is held
  double largest_gap_mm = kNaN;     // between the two surfaces
  double largest_angle_deg = kNaN;  // between their tangent planes
  double allowed_gap_mm = kNaN;     // a millionth of the points' extent
  bool is_at_limit = false;         // finer would need more than kMostExactPoints places

  // Whether it is as it was asked for: no gap to speak of, and with continuity: tangent_plane at
  // most 0.1 degrees.
  bool Holds() const;
};

// A line each, for people.
std::vector<std::string> JoinLines(std::span<const JoinReport> joins);
nlohmann::ordered_json JoinsJson(std::span<const JoinReport> joins);

}  // namespace semblance
