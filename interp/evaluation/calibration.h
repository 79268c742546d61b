// SPDX-License-Identifier: GPL-3.0-or-later
// Do stated standard deviations hold?
#pragma once

#include <span>
#include <vector>

namespace semblance {

// The share, 0..1, that the smallest central interval of a normal distribution with the error in it
// should hold. An sd of 0 holds an error of 0, within rounding (1e-9), and no other. sd >= 0.
double ShareAround(double error, double sd);

// Shares, 0..1, of the errors that lie within the central interval of a normal distribution of the
// stated sd which should hold 5 %, 10 %, .. 95 % of them: 19 values, rising; by ShareAround. Over
// the errors for which both error and sd are finite; weights: one per error, >= 0, or none for
// equal ones. Empty where nothing counts.
std::vector<double> Coverage(std::span<const double> errors, std::span<const double> sds,
                             std::span<const double> weights = {});

// The share at 90 % of such a curve; NaN for an empty one.
double CoverageAt90(const std::vector<double>& coverage);

}  // namespace semblance
