// SPDX-License-Identifier: GPL-3.0-or-later
// Spreads work over threads by index. Each index writes only its own result.
#pragma once

#include <cstddef>
#include <functional>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

// Calls body(i) once for each i in [0, count), on up to `threads` threads (>= 1), in blocks of
// `block` (>= 1) indices. body(i) must write only to data of index i; then the result does not
// depend on the number of threads. If bodies throw, the exception of the lowest block is rethrown.
void ParallelFor(std::size_t count, int threads, std::size_t block,
                 const std::function<void(std::size_t)>& body);

}  // namespace semblance::surfaces
