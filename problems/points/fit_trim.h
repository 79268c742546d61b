// SPDX-License-Identifier: GPL-3.0-or-later
// Which part of a fitted surface is shown and written as triangles: all, or what is near points.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "fitting/plan/fit_result.h"
#include "surfaces/base/auto_or.h"
#include "surfaces/base/fields.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {

// The whole domain.
struct NoTrim {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoTrim&) {}

// What is near a point of the cloud. Not by the points' borders in (u,v), which noise and a
// scanner's rows fray: near in space is the same for every parametrisation.
struct CloudTrim {
  static constexpr std::string_view kName = "cloud";
  AutoOr<double> distance_mm = AutoOr<double>::Auto();  // from the nearest point
};
template <class Visitor>
void Fields(Visitor& visit, CloudTrim& o) {
  visit(FieldInfo{.name = "distance_mm",
                  .unit = "mm",
                  .min = 1e-9,
                  .max = 1e6,
                  .doc = "how far from the nearest point the surface is kept; holes up to twice as "
                         "wide are closed. auto: 1.25 times the distance within which 99 % of the "
                         "points have eight others"},
        o.distance_mm);
}

using Trim = std::variant<NoTrim, CloudTrim>;

// Before the fit, what could only be refused after it. Throws InputError for a distance that is
// less than what neighbouring points are apart, for the surface would fall into as many pieces; and
// where `auto` finds that most points coincide, or that they are too few.
void CheckTrim(const Trim& trim, std::span<const Vec3> positions);

// Where a surface is kept: within a distance of the points' places on it, outliers apart.
struct TrimmedTo {
  PointQuery places;
  double distance_mm = kNaN;
};
// Nothing for a surface that is kept whole. Throws InputError as CheckTrim does for `auto`.
std::optional<TrimmedTo> TrimOf(const Trim& trim, const FitResult& fit, int threads);

// What was kept and cut.
struct TrimReport {
  double distance_mm = kNaN;
  double kept_mm2 = kNaN, cut_mm2 = kNaN;  // areas
};
// "trimmed to within 1.2 mm of a point: 31 % of the surface is left out".
std::string TrimText(const TrimReport& report);

}  // namespace semblance
