// SPDX-License-Identifier: GPL-3.0-or-later
// The file configs/faces/ict/bust.json, the head of the ICT-FaceKit model (MIT licence, see
// NOTICE); CMake puts its text into the program.
#pragma once

#include <string_view>

namespace semblance {

std::string_view IctHead();

}  // namespace semblance
