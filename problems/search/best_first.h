// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace semblance {

// The indices of costs, the least first; equal ones, and at the end those that are not finite, in
// the order in which they stand.
std::vector<std::size_t> BestFirst(std::span<const double> costs);

}  // namespace semblance
