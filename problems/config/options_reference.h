// SPDX-License-Identifier: GPL-3.0-or-later
// The description of all options, as text for people.
#pragma once

#include <string>

#include "problems/config/config_types.h"

namespace semblance {

// One paragraph a path: "emitter.decay (type: split): number, default 6, 0.5 to 50", then its
// meaning, indented. An item of a list is `path[]`, an entry of a map `path.<name>`.
std::string ReferenceText(const ConfigType& type);

}  // namespace semblance
