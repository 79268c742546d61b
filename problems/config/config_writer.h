// SPDX-License-Identifier: GPL-3.0-or-later
// Trees as YAML text that the strict reader reads back.
#pragma once

#include <string>

#include "problems/config/config_tree.h"

namespace semblance {

// In block style, a line for each entry, ending in a newline. Throws InputError where a number is
// not finite.
std::string ToYaml(const ConfigNode& tree);

// On one line: {a: 1, b: [2, 3]}. Numbers that are not finite are written as they are.
std::string ToFlowYaml(const ConfigNode& tree);

}  // namespace semblance
