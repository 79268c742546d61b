// SPDX-License-Identifier: GPL-3.0-or-later
// How the batches of emitters are compiled. For flat_batch.cc and distance_batch.cc alone.
#pragma once

// Wider instructions where the processor has them. They round alike: nothing is contracted. Under a
// sanitizer the choice at load time would run before the sanitizer does.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__)
#define SEMBLANCE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define SEMBLANCE_WIDE
#endif

// Inlined, so that each clone has it in its own instructions.
#define SEMBLANCE_INLINE [[gnu::always_inline]] inline
