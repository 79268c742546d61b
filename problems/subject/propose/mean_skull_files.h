// SPDX-License-Identifier: GPL-3.0-or-later
// The files of configs/mean_skull. CMake puts their text into the program.
#pragma once

#include <string_view>

namespace semblance::problems {

std::string_view MeanSkullMesh();   // mean.off
std::string_view MeanSkullModes();  // modes.csv
std::string_view MeanSkullSites();  // sites.csv

}  // namespace semblance::problems
