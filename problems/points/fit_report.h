// SPDX-License-Identifier: GPL-3.0-or-later
// What an automatic fit assumed, in words and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "fitting/nested/nested_fit.h"
#include "fitting/relaxation/foot_moves.h"

namespace semblance {

nlohmann::ordered_json AutoJson(const AutoReport& report);

// A few lines for people: noise, outliers, and whether points of this density can support more.
std::string AutoText(const AutoReport& report);

// How (u,v) were moved before the fit.
nlohmann::ordered_json MovesJson(const FootMoves& moves);
std::string MovesText(const FootMoves& moves);

}  // namespace semblance
