// SPDX-License-Identifier: GPL-3.0-or-later
// The weight of a smoothness term, chosen by the data (`weight: auto`).
#pragma once

#include <span>

#include "fitting/solve/space_system.h"
#include "fitting/terms/term.h"

namespace semblance {

// The least squares |e - A d|^2 + |fixed terms|^2 + lambda |smoothness|^2 in steps d from where the
// surface stands, for each coordinate.
struct WeightProblem {
  NormalSystem points;
  NormalSystem smooth;   // at weight 1
  NormalSystem fixed;    // other terms, or 0 x 0
  double misfit = kNaN;  // |e|^2, in the units of `points`
  double count = kNaN;   // of points
};

struct WeightChoice {
  double weight = kNaN;              // lambda
  double score = kNaN;               // of generalised cross-validation, units of the misfit
  double degrees_of_freedom = kNaN;  // trace of the influence matrix, per coordinate
};

// The lambda that makes misfit(lambda) / (1 - trace / count)^2 least (Craven & Wahba 1979): by
// decades, from smooth to rough until the score has turned, then between them; and of those within
// 1 % of the least score the largest, which bridges gaps best. The trace is exact for up to 256
// unknowns; else that of Hutchinson's estimator with 32 fixed probes, good to a few parts in a
// thousand (8 while it goes by decades). near: a weight to search around (a decade up and down); 0:
// everywhere.
WeightChoice ChooseWeight(const WeightProblem& problem, double near = 0);

// The index of the term that is `auto`, or -1; InputError for more than one.
int AutoTerm(std::span<const Term> terms);
// The sum of those of the terms `points`.
double PointWeight(std::span<const Term> terms);
// What a SmoothnessTerm of that length weighs beside the terms for each unit that one of 1 mm
// weighs beside points of weight 1, for the same surface.
double WeightAsWritten(std::span<const Term> terms, double length_mm);
// Gives a smoothness or membrane term a weight.
void SetWeight(double weight, Term& term);

}  // namespace semblance
