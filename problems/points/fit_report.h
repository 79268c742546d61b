// SPDX-License-Identifier: GPL-3.0-or-later
// What an automatic fit assumed, in words and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "fitting/nested/nested_fit.h"

namespace semblance {

nlohmann::ordered_json AutoJson(const AutoReport& report);

// A few lines for people: noise, outliers, and whether points of this density can support more.
std::string AutoText(const AutoReport& report);

}  // namespace semblance
