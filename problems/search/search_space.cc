// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/search/search_space.h"

#include <algorithm>
#include <cmath>

namespace semblance {
namespace {

// The ends of an axis of numbers as it is divided: each whole number has as much of it as the next.
struct Ends {
  double low = 0, high = 1;
};
Ends EndsOf(const SearchAxis& axis) {
  const double margin = axis.whole ? 0.5 : 0;
  const Ends ends{axis.low - margin, axis.high + margin};
  return axis.log ? Ends{std::log(ends.low), std::log(ends.high)} : ends;
}

double ValueAt(const SearchAxis& axis, double share) {
  if (axis.choices > 0) {
    return std::min(std::floor(share * axis.choices), axis.choices - 1.0);
  }
  const Ends ends = EndsOf(axis);
  const double at = ends.low + share * (ends.high - ends.low);
  const double value = axis.log ? std::exp(at) : at;
  return std::clamp(axis.whole ? std::round(value) : value, axis.low, axis.high);
}

double ShareOf(const SearchAxis& axis, double value) {
  const Ends ends = EndsOf(axis);
  return ((axis.log ? std::log(value) : value) - ends.low) / (ends.high - ends.low);
}

double Mirrored(double x) {
  const double within = std::fmod(std::abs(x), 2.0);
  return within > 1 ? 2 - within : within;
}

}  // namespace

std::vector<int> AxesOfCode(const SearchSpace& space) {
  std::vector<int> axes;
  for (std::size_t k = 0; k < space.size(); ++k) {
    axes.insert(axes.end(), std::max(space[k].choices, 1), static_cast<int>(k));
  }
  return axes;
}

Eigen::VectorXd Encode(const SearchSpace& space, const SearchPoint& point) {
  Eigen::VectorXd code = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(AxesOfCode(space).size()));
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < space.size(); ++k) {
    if (space[k].choices > 0) {
      code[at + static_cast<Eigen::Index>(point[k])] = 1;
      at += space[k].choices;
    } else {
      code[at++] = ShareOf(space[k], point[k]);
    }
  }
  return code;
}

SearchPoint Decode(const SearchSpace& space, const Eigen::VectorXd& code) {
  SearchPoint point;
  Eigen::Index at = 0;
  for (const SearchAxis& axis : space) {
    if (axis.choices > 0) {
      Eigen::Index largest = 0;
      code.segment(at, axis.choices).maxCoeff(&largest);
      point.push_back(static_cast<double>(largest));
      at += axis.choices;
    } else {
      point.push_back(ValueAt(axis, Mirrored(code[at++])));
    }
  }
  return point;
}

SearchPoint PointAt(const SearchSpace& space, std::span<const double> shares) {
  SearchPoint point;
  for (std::size_t k = 0; k < space.size(); ++k) {
    point.push_back(ValueAt(space[k], shares[k]));
  }
  return point;
}

SearchPoint RandomPoint(const SearchSpace& space, Random& random) {
  std::vector<double> shares;
  for (std::size_t k = 0; k < space.size(); ++k) {
    shares.push_back(random.Uniform());
  }
  return PointAt(space, shares);
}

}  // namespace semblance
