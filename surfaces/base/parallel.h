// SPDX-License-Identifier: GPL-3.0-or-later
// The one way to spread work over threads: by index, each index writing only what it owns.
#pragma once

#include <cstddef>
#include <functional>

namespace semblance {

// Calls body(i) once for each i in [0, count), on up to `threads` threads, in blocks of `block`
// indices. The body must write only to what belongs to index i, so that the result does not depend
// on the number of threads. If bodies throw, the exception of the lowest block
// is rethrown.
// threads >= 1, block >= 1.
void ParallelFor(std::size_t count, int threads, std::size_t block,
                 const std::function<void(std::size_t)>& body);

}  // namespace semblance
