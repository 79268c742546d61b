// SPDX-License-Identifier: GPL-3.0-or-later
// The files of configs/faces/ict and configs/faces/people: face and head of the ICT-FaceKit model,
// and its mean without bias (MIT licence, see NOTICE). CMake puts their text into the program.
#pragma once

#include <string_view>

namespace semblance::problems {

std::string_view IctSurface();     // ict/head.hspline.json
std::string_view IctSites();       // ict/sites.csv
std::string_view IctFeatures();    // ict/features.json
std::string_view IctModes();       // ict/modes.json
std::string_view IctHead();        // ict/bust.json
std::string_view PeopleSurface();  // people/head.hspline.json

}  // namespace semblance::problems
