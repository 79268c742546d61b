// SPDX-License-Identifier: GPL-3.0-or-later
// What a search asks for, and how much of it.
#pragma once

#include <cstdint>

#include "problems/search/search_space.h"

namespace semblance {

struct SearchAsk {
  SearchPoint point;
  int rung = 0;  // how long a run; the last of the method's rungs is the run in full
};

struct SearchBudget {
  int full_runs = 1;  // of a treatment; short ones count by their length
  std::uint64_t random_seed = 1;
};

}  // namespace semblance
