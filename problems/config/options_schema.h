// SPDX-License-Identifier: GPL-3.0-or-later
// The description of all options, as JSON Schema for editors.
#pragma once

#include <string>

#include "problems/config/config_types.h"

namespace semblance {

// A JSON Schema, draft 2020-12, of a file with these options.
std::string SchemaText(const ConfigType& type);

}  // namespace semblance
