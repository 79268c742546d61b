// SPDX-License-Identifier: GPL-3.0-or-later
// The report of a population, as one page.
#pragma once

#include <string>

#include "problems/population/population_result.h"

namespace semblance {

// Returns HTML that contains its pictures. Nothing in it depends on time or machine.
std::string PopulationReport(const PopulationResult& result);

}  // namespace semblance
