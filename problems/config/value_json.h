// SPDX-License-Identifier: GPL-3.0-or-later
// Values of options as JSON, for programs that do not read YAML.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "problems/config/config_types.h"

namespace semblance {

// tree: of a value of that type, as ConfigTreeOf makes it. A map for a struct; a map with `type`
// for a variant; null for a number that is not finite.
nlohmann::ordered_json ValueJson(const ConfigNode& tree, const ConfigType& type);

}  // namespace semblance
