// SPDX-License-Identifier: GPL-3.0-or-later
// The text of configs/people/depth.csv, which CMake puts into the program (MIT licence, see
// NOTICE).
#pragma once

#include <string_view>

namespace semblance::interp {

std::string_view PeopleFile();

}  // namespace semblance::interp
