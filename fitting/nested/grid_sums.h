// SPDX-License-Identifier: GPL-3.0-or-later
// Sums and scalar products of numbers at the vertices of a level, eight at a time. The eight sums
// are added in one order, so that every processor gives the same bits.
#pragma once

#include "fitting/nested/grid_values.h"

namespace semblance {

// All pointers are to places by GridLayout::At; what stands outside of the runs is left alone.

double DotOn(const GridRuns& runs, const double* a, const double* b);
// The sum of inverse * residual^2.
double SquaresOn(const GridRuns& runs, const double* inverse, const double* residual);
// to = from.
void CopyOn(const GridRuns& runs, const double* from, double* to);
// inverse = 1 / (data + factor * energy) where `active`, else 0.
void InvertOn(const GridRuns& runs, const double* data, const double* energy, double factor,
              const char* active, double* inverse);
// residual -= product. Returns what SquaresOn does then.
double SubtractOn(const GridRuns& runs, const double* inverse, const double* product,
                  double* residual);

// What a step of conjugate gradients moves, of one channel of one level.
struct GridStep {
  const double* inverse;
  const double* product;  // of the direction
  double* direction;
  double* residual;
  double* solution;
};
// solution += length * direction, residual -= length * product. Returns the sum of inverse *
// residual^2.
double AdvanceOn(const GridRuns& runs, const GridStep& step, double length);
// direction = inverse * residual + factor * direction.
void TurnOn(const GridRuns& runs, const GridStep& step, double factor);

}  // namespace semblance
