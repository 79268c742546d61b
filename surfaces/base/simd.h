// SPDX-License-Identifier: GPL-3.0-or-later
// Computes with four or eight numbers in one register. Files that use this header have their own
// compiler options (see CMakeLists.txt).
#pragma once

#include <array>
#include <cmath>
#include <cstring>

#include "surfaces/base/layers.h"

// Compiles functions also for newer processors and chooses a version when the program starts. All
// versions give the same bits, because no operations are contracted (-ffp-contract=off). The build
// option SEMBLANCE_WIDEST_BITS leaves out the widest version, so that a test can compare the bits
// (make same-bytes). Sanitizers switch this off, because the choice would run before the sanitizer
// starts.
#ifndef SEMBLANCE_WIDEST_BITS
#define SEMBLANCE_WIDEST_BITS 512
#endif
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SEMBLANCE_CLONED_BITS SEMBLANCE_WIDEST_BITS
#else
#define SEMBLANCE_CLONED_BITS 0
#endif
#if SEMBLANCE_CLONED_BITS >= 512
#define SEMBLANCE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#define SEMBLANCE_ONLY_512 __attribute__((target("avx512f")))
#elif SEMBLANCE_CLONED_BITS >= 256
#define SEMBLANCE_WIDE __attribute__((target_clones("avx2", "default")))
#define SEMBLANCE_ONLY_512
#else
#define SEMBLANCE_WIDE
#define SEMBLANCE_ONLY_512
#endif
#if SEMBLANCE_CLONED_BITS >= 256
#define SEMBLANCE_WIDE_256 __attribute__((target_clones("avx2", "default"), noinline))
#else
#define SEMBLANCE_WIDE_256
#endif

// Forces inlining, so that each version compiles the function for its own instruction set.
#define SEMBLANCE_INLINE [[gnu::always_inline]] inline

namespace semblance::surfaces {

using Wide = double __attribute__((vector_size(32)));
// Suited to sums and products anywhere. Comparisons belong in functions for AVX-512 alone
// (SEMBLANCE_ONLY_512). Elsewhere the compiler splits a comparison of eight numbers into eight
// single ones, which made sums of emitters take three times as long as with four numbers.
using Wider = double __attribute__((vector_size(64)));

// Returns true if functions for AVX-512 alone may be called.
inline bool HasAvx512() {
#if SEMBLANCE_CLONED_BITS >= 512
  return __builtin_cpu_supports("avx512f") != 0;
#else
  return false;
#endif
}

// The following templates take N = Wider, Wide or double and give the same bits for each.
template <class N>
inline constexpr int kLaneCount = sizeof(N) / sizeof(double);

template <class N, std::size_t count>
SEMBLANCE_INLINE N Load(const std::array<double, count>& from, int first) {
  N n;
  std::memcpy(&n, from.data() + first, sizeof(n));
  return n;
}
template <class N, std::size_t count>
SEMBLANCE_INLINE void Store(const N& n, std::array<double, count>& to, int first) {
  std::memcpy(to.data() + first, &n, sizeof(n));
}

template <class N>
SEMBLANCE_INLINE N Greater(const N& a, const N& b) {
  return a > b ? a : b;
}
template <class N>
SEMBLANCE_INLINE N Smaller(const N& a, const N& b) {
  return a < b ? a : b;
}
template <class N>
SEMBLANCE_INLINE N All(double value) {
  return N{} + value;
}
template <class N>
SEMBLANCE_INLINE N Magnitude(const N& a) {
  return Greater(a, -a);
}

template <class N>
SEMBLANCE_INLINE N SquareRoot(const N& a) {
  double root[kLaneCount<N>];
  std::memcpy(root, &a, sizeof(a));
  for (double& r : root) {
    r = std::sqrt(r);
  }
  N n;
  std::memcpy(&n, root, sizeof(n));
  return n;
}

// Returns square^(-power / 2). whole: the power if it is an integer, else -1.
template <class N>
SEMBLANCE_INLINE N InversePowerFromSquare(const N& square, double power, int whole) {
  if (whole < 0) {
    double result[kLaneCount<N>];
    std::memcpy(result, &square, sizeof(square));
    for (double& r : result) {
      r = std::pow(r, -0.5 * power);
    }
    N n;
    std::memcpy(&n, result, sizeof(n));
    return n;
  }
  N factor = 1 / square;
  N result = (whole & 1) != 0 ? SquareRoot(factor) : All<N>(1);
  for (int rest = whole >> 1; rest != 0; rest >>= 1) {
    if ((rest & 1) != 0) {
      result *= factor;
    }
    factor *= factor;
  }
  return result;
}

}  // namespace semblance::surfaces
