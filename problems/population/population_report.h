// SPDX-License-Identifier: GPL-3.0-or-later
// The report page of a population.
#pragma once

#include <string>

#include "problems/population/population_result.h"

namespace semblance::problems {

// Makes an HTML page with its pictures inside. Nothing in it depends on time or machine.
std::string PopulationReport(const PopulationResult& result);

}  // namespace semblance::problems
