// SPDX-License-Identifier: GPL-3.0-or-later
// The exit codes of the program.
#pragma once

namespace semblance::problems {

inline constexpr int kDone = 0, kNotUsable = 1, kBadInput = 2;

}  // namespace semblance::problems
