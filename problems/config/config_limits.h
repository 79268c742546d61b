// SPDX-License-Identifier: GPL-3.0-or-later
// How large a configuration can be. What is followed by recursion must not be deeper than a stack.
#pragma once

#include <cstddef>

namespace semblance {

// Maps and lists within each other, steps of a path, bases with theirs.
inline constexpr std::size_t kDeepestConfig = 64;
// Of one map; they are looked for one by one.
inline constexpr int kMostKeys = 10'000;
inline constexpr std::size_t kLargestConfig_bytes = 16'000'000;

}  // namespace semblance
