// SPDX-License-Identifier: GPL-3.0-or-later
// What a search chooses from: axes of numbers and of choices, and the code in which a method sees
// them, so that it knows the unit cube only.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "surfaces/base/random.h"

namespace semblance {

struct SearchAxis {
  double low = 0, high = 1;  // of a number, both allowed
  bool whole = false;        // whole numbers alone
  bool log = false;          // even by its logarithm; low is above 0 then
  int choices = 0;           // not 0: one of so many things without an order, and no number
};
using SearchSpace = std::vector<SearchAxis>;

// A value for each axis: the number, or which of the choices (from 0).
using SearchPoint = std::vector<double>;

// The axis of each number of a code. A number has one, between 0 at the low end and 1 at the high
// one; choices have an indicator each, of which the largest is meant.
std::vector<int> AxesOfCode(const SearchSpace& space);

// The point's code; its indicators are 0 but for a 1.
Eigen::VectorXd Encode(const SearchSpace& space, const SearchPoint& point);

// The point that any code stands for: beyond 0 and 1 the numbers go back as from a mirror; of equal
// indicators the first counts.
SearchPoint Decode(const SearchSpace& space, const Eigen::VectorXd& code);

// The point at a share in [0,1) of each axis.
SearchPoint PointAt(const SearchSpace& space, std::span<const double> shares);

// Even over the space.
SearchPoint RandomPoint(const SearchSpace& space, Random& random);

}  // namespace semblance
