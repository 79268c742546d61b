// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/grid_sums.h"

#include "fitting/nested/lanes.h"

namespace semblance {
namespace {

// body(k) for each block of eight of the runs.
template <class Body>
SEMBLANCE_INLINE void ForEachBlock(const GridRuns& runs, const Body& body) {
  for (const GridRun& run : runs) {
    for (int block = 0; block < run.blocks; ++block) {
      body(run.at + static_cast<std::size_t>(GridLayout::kBlock) * block);
    }
  }
}

}  // namespace

SEMBLANCE_WIDE double DotOn(const GridRuns& runs, const double* a, const double* b) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k)
                __attribute__((always_inline)) { sum += EightAt(a + k) * EightAt(b + k); });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE double SquaresOn(const GridRuns& runs, const double* inverse,
                                const double* residual) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        const Wider r = EightAt(residual + k);
        sum += EightAt(inverse + k) * r * r;
      });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE void CopyOn(const GridRuns& runs, const double* from, double* to) {
  ForEachBlock(
      runs, [&](std::size_t k)
                __attribute__((always_inline)) { PutEight(EightAt(from + k), to + k); });
}

void InvertOn(const GridRuns& runs, const double* data, const double* energy, double factor,
              const char* active, double* inverse) {
  for (const GridRun& run : runs) {
    for (std::size_t k = run.at; k < run.at + run.size(); ++k) {
      const double diagonal = data[k] + factor * energy[k];
      inverse[k] = active[k] != 0 && diagonal > 0 ? 1 / diagonal : 0;
    }
  }
}

SEMBLANCE_WIDE double SubtractOn(const GridRuns& runs, const double* inverse, const double* product,
                                 double* residual) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        const Wider r = EightAt(residual + k) - EightAt(product + k);
        PutEight(r, residual + k);
        sum += EightAt(inverse + k) * r * r;
      });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE double AdvanceOn(const GridRuns& runs, const GridStep& step, double length) {
  Wider sum{};
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        const Wider r = EightAt(step.residual + k) - length * EightAt(step.product + k);
        PutEight(EightAt(step.solution + k) + length * EightAt(step.direction + k),
                 step.solution + k);
        PutEight(r, step.residual + k);
        sum += EightAt(step.inverse + k) * r * r;
      });
  return SumOfEight(sum);
}

SEMBLANCE_WIDE void TurnOn(const GridRuns& runs, const GridStep& step, double factor) {
  ForEachBlock(
      runs, [&](std::size_t k) __attribute__((always_inline)) {
        PutEight(EightAt(step.inverse + k) * EightAt(step.residual + k) +
                     factor * EightAt(step.direction + k),
                 step.direction + k);
      });
}

}  // namespace semblance
