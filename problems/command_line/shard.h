// SPDX-License-Identifier: GPL-3.0-or-later
// Which part of some work a process does: every N-th piece from the I-th.
#pragma once

#include <string>

namespace semblance {

struct Shard {
  int index = 0, count = 1;
};

// "I/N" with 0 <= I < N; for an empty text what Slurm says of an array of jobs
// (SLURM_ARRAY_TASK_ID, _COUNT), else all. Throws InputError for anything else.
Shard ShardOf(const std::string& text);

}  // namespace semblance
