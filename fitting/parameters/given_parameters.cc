// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/given_parameters.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

#include "fitting/parameters/map_candidate.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

using Ranges = std::array<std::array<double, 2>, 2>;  // of u and v

// Why the point cannot be taken; empty if it can.
std::string UvFault(const Vec2& uv, const Ranges& ranges) {
  if (!uv.allFinite()) {
    return fmt::format("has (u,v) = ({}, {}), which is not finite; give numbers, or leave it out",
                       uv.x(), uv.y());
  }
  const bool inside = uv.x() >= ranges[0][0] && uv.x() <= ranges[0][1] && uv.y() >= ranges[1][0] &&
                      uv.y() <= ranges[1][1];
  return inside ? ""
                : fmt::format("has (u,v) = ({}, {}), outside [{}, {}] x [{}, {}]", uv.x(), uv.y(),
                              ranges[0][0], ranges[0][1], ranges[1][0], ranges[1][1]);
}

// Ranges that hold all the points: those that there are, widened.
std::string WiderRanges(std::span<const Vec2> uv, Ranges ranges) {
  for (const Vec2& p : uv) {
    for (const int c : {0, 1}) {
      ranges[c] = {std::fmin(ranges[c][0], p[c]), std::fmax(ranges[c][1], p[c])};
    }
  }
  return fmt::format("parameters: {{type: given, u_range: [{}, {}], v_range: [{}, {}]}}",
                     ranges[0][0], ranges[0][1], ranges[1][0], ranges[1][1]);
}

// (u,v) beside the domain are told with ranges that would hold all of them.
void CheckGiven(std::span<const Vec2> uv, const Ranges& ranges, const PointNames& name_of) {
  for (std::size_t k = 0; k < uv.size(); ++k) {
    if (const std::string fault = UvFault(uv[k], ranges); !fault.empty()) {
      throw InputError(fmt::format(
          "{} {}{}", name_of ? name_of(k) : fmt::format("point {}", k + 1), fault,
          uv[k].allFinite() ? fmt::format("; to take all points, write {}", WiderRanges(uv, ranges))
                            : ""));
    }
  }
}

}  // namespace

Parametrisation TakeGiven(std::vector<Vec2> given_uv, const GivenParameters& given,
                          const PointNames& name_of) {
  const Ranges ranges = {given.u_range, given.v_range};
  for (const auto& [low, high] : ranges) {
    if (!(high > low)) {
      FailParameters(
          fmt::format("the range [{}, {}] is empty; give the lower bound first", low, high));
    }
  }
  CheckGiven(given_uv, ranges, name_of);
  for (Vec2& uv : given_uv) {
    for (const int c : {0, 1}) {
      uv[c] = (uv[c] - ranges[c][0]) / (ranges[c][1] - ranges[c][0]);
    }
  }
  return {.uv = std::move(given_uv), .source = ParameterSource::kGiven};
}

Parametrisation ParametriseBy(const Scan& points, const GivenParameters& given) {
  if (points.given_uv.empty()) {
    FailParameters(
        "type 'given' needs each point's (u,v) (of a table, the columns u and v); give them, or "
        "take 'plane', 'cylinder' or 'mesh'");
  }
  return TakeGiven({points.given_uv.begin(), points.given_uv.end()}, given, points.name_of);
}

}  // namespace semblance
