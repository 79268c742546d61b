// SPDX-License-Identifier: GPL-3.0-or-later
// The files of configs/faces/ict: face and head of the ICT-FaceKit model (MIT licence, see NOTICE).
// CMake puts their text into the program.
#pragma once

#include <string_view>

namespace semblance::problems {

std::string_view IctSurface();   // head.hspline.json
std::string_view IctSites();     // sites.csv
std::string_view IctFeatures();  // features.json
std::string_view IctModes();     // modes.json
std::string_view IctHead();      // bust.json

}  // namespace semblance::problems
