// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit reports, as JSON; null where there is not a number.
#pragma once

#include <nlohmann/json.hpp>

#include "fitting/fit.h"

namespace semblance {

// {"levels": [...], "relaxations": [...]}; the latter is left out without relaxation.
nlohmann::ordered_json StepsToJson(const FitResult& fit);

}  // namespace semblance
