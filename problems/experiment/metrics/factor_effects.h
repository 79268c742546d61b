// SPDX-License-Identifier: GPL-3.0-or-later
// Effects of the factors of a complete grid of treatments, e.g. 4 schemes x 3 numbers of markers.
// Every subject has one value per cell, so that subjects are compared only with themselves.
#pragma once

#include <cstddef>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance::problems {

// The values of a complete grid. The last factor's levels vary fastest along a row.
struct GridValues {
  std::vector<std::size_t> levels;           // number of levels of each factor, 2 or more
  std::vector<std::vector<double>> subject;  // one row per subject, one value per cell
};

// Throws InputError unless there is a factor, each factor has two levels or more, and each subject
// has a finite value in every cell.
void CheckGrid(const GridValues& grid);

// The means of a subject over all cells with the same levels of the chosen factors (ascending
// indices), the last chosen factor fastest.
std::vector<double> LevelMeans(const GridValues& grid, std::size_t subject,
                               const std::vector<std::size_t>& factors);

// The effect of one factor (main effect), or the interaction of several: the part of their means
// that the effects of fewer factors leave unexplained.
struct FactorEffect {
  std::vector<std::size_t> factors;
  // Sum of squares of the effect, divided by that of all deviations of the values from the mean of
  // their subject: 0 to 1. The shares of all effects add up to 1, except for the part in which
  // subjects respond differently. NaN if no value differs from its subject's mean.
  double share = kNaN;
  double p = kNaN;
  bool exact = false;  // all arrangements were counted; else up to 19,999 were drawn
};

// Tests an effect by permutation within subjects (Pesarin and Salmaso 2010, chapter 7). Without an
// effect, the levels of each of its factors could be exchanged within any subject. The test counts
// how many of these arrangements have a sum of squares at least as large as the observed one. It
// assumes neither a distribution nor equal spread between subjects. For two levels it is the exact
// paired permutation test: n subjects cannot reach p below 2^(1 - n).
FactorEffect ComputeEffect(const GridValues& grid, const std::vector<std::size_t>& factors);

// Removes the differences between subjects from their rows: each value loses its subject's mean and
// gains the mean of all. The deviations from the mean of a column are widened by sqrt(C / (C - 1))
// for C columns (Morey 2008), because the subject's mean contains the value itself. Intervals of
// the columns' means then show differences within subjects (Cousineau 2005).
std::vector<std::vector<double>> RemoveSubjectMeans(const std::vector<std::vector<double>>& rows);

}  // namespace semblance::problems
