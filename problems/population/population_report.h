// SPDX-License-Identifier: GPL-3.0-or-later
// What a population came to, as a page.
#pragma once

#include <string>

#include "problems/population/population_result.h"

namespace semblance {

// HTML with its pictures inside; nothing in it depends on time or machine.
std::string PopulationReport(const PopulationResult& result);

}  // namespace semblance
