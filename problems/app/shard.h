// SPDX-License-Identifier: GPL-3.0-or-later
// The part of some work that one process does: every count-th piece, from piece `index` (from 0).
#pragma once

#include <string>

namespace semblance::problems {

struct Shard {
  int index = 0, count = 1;
};

// Reads "I/N" with 0 <= I < N. For an empty text, takes Slurm's variables of an array of jobs
// (SLURM_ARRAY_TASK_ID and _COUNT), or all work if they are not set. Throws InputError for any
// other text.
Shard ParseShard(const std::string& text);

}  // namespace semblance::problems
