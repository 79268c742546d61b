// SPDX-License-Identifier: GPL-3.0-or-later
// A folder of subjects as a population.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "problems/population/population_file.h"

namespace semblance {

// As ReadPopulation says of folders. Adds a note for each folder that is passed over. Throws as it.
PopulationFile FolderPopulation(const std::filesystem::path& folder,
                                std::vector<std::string>& notes);

}  // namespace semblance
