// SPDX-License-Identifier: GPL-3.0-or-later
// A folder of subjects as a population.
#pragma once

#include <filesystem>

#include "problems/population/population_file.h"

namespace semblance {

// As ReadPopulation says of folders. Throws as it.
PopulationFile FolderPopulation(const std::filesystem::path& folder);

}  // namespace semblance
