// SPDX-License-Identifier: GPL-3.0-or-later
// What the program tells the shell.
#pragma once

namespace semblance {

inline constexpr int kDone = 0, kNotUsable = 1, kBadInput = 2;

}  // namespace semblance
