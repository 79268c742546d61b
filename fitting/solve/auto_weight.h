// SPDX-License-Identifier: GPL-3.0-or-later
// The weight of a smoothness term, chosen by the data (`weight: auto`).
#pragma once

#include <span>

#include "fitting/solve/space_system.h"
#include "fitting/terms/term.h"

namespace semblance::fitting {

// The least-squares problem |e - A d|^2 + |fixed terms|^2 + lambda |smoothness|^2 in steps d from
// the present surface, for each coordinate.
struct WeightProblem {
  NormalSystem points;
  NormalSystem smooth;   // at weight 1
  NormalSystem fixed;    // all other terms, or 0 x 0
  double misfit = kNaN;  // |e|^2, in the units of `points`
  double count = kNaN;   // number of points
};

struct WeightChoice {
  double weight = kNaN;              // lambda
  double score = kNaN;               // score of generalised cross-validation, units of the misfit
  double degrees_of_freedom = kNaN;  // trace of the influence matrix, per coordinate
};

// Finds the lambda with the least score misfit(lambda) / (1 - trace / count)^2 (Craven & Wahba
// 1979). The search proceeds by decades from smooth to rough until the score rises, then between
// decades. Among the weights with a score within 1 % of the least it returns the largest, which
// bridges gaps best. The trace is exact for up to 256 unknowns. For more unknowns it is
// Hutchinson's estimate with 32 fixed probes, accurate to a few parts in a thousand (8 probes for
// the decades). near: a weight to search around, a decade up and down; 0: search everywhere.
WeightChoice ChooseWeight(const WeightProblem& problem, double near = 0);

// The index of the term with `weight: auto`, or -1. Throws InputError for more than one.
int AutoTerm(std::span<const Term> terms);
// The sum of the weights of the terms `points`.
double PointWeight(std::span<const Term> terms);
// The factor that converts the weight of a SmoothnessTerm with length 1 mm and points of weight 1
// into that with the given length and these terms, for the same surface.
double WeightAsWritten(std::span<const Term> terms, double length_mm);
// Sets the weight of a smoothness or membrane term. Other terms stay unchanged.
void SetWeight(double weight, Term& term);

}  // namespace semblance::fitting
