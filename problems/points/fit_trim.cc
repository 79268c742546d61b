// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/fit_trim.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"
#include "surfaces/hspline_query/hspline_batch.h"

namespace semblance {
namespace {

// Of the distances from some of the points to those that are `rank`-th nearest; infinite where
// there are fewer.
double NeighbourDistance(const PointQuery& query, std::span<const Vec3> points, int rank,
                         double share) {
  constexpr std::size_t kEnough = 20'000;
  const std::size_t every = std::max<std::size_t>(points.size() / kEnough, 1);
  std::vector<double> distances;
  for (std::size_t k = 0; k < points.size(); k += every) {
    distances.push_back(query.DistanceTo(points[k], rank + 1));  // the first is the point itself
  }
  return Quantile(distances, share);
}

double AutoDistance(const PointQuery& query, std::span<const Vec3> points) {
  constexpr int kNeighbours = 8;
  constexpr double kShare = 0.99, kFactor = 1.25;
  const double distance_mm = kFactor * NeighbourDistance(query, points, kNeighbours, kShare);
  if (!(distance_mm > 0) || !std::isfinite(distance_mm)) {
    throw InputError(
        "trim.distance_mm: auto looks at each point's eight neighbours, and here most coincide or "
        "there are fewer; give a distance in mm, or write trim: none");
  }
  return distance_mm;
}

// Without outliers.
std::vector<Vec3> PlacesOf(const FitResult& fit, int threads) {
  std::vector<Vec3> places = HSplineBatch(fit.surface).Points(fit.uv, threads);
  if (fit.automatic) {
    for (const std::uint32_t outlier : fit.automatic->outliers) {
      places[outlier].setConstant(kNaN);
    }
  }
  std::erase_if(places, [](const Vec3& place) { return !place.allFinite(); });
  return places;
}

}  // namespace

void CheckTrim(const Trim& trim, std::span<const Vec3> positions) {
  const auto* const cloud = std::get_if<CloudTrim>(&trim);
  if (cloud == nullptr || positions.empty()) {
    return;
  }
  const PointQuery query(positions);
  if (cloud->distance_mm.automatic) {
    AutoDistance(query, positions);
    return;
  }
  const double apart_mm = positions.size() > 1 ? NeighbourDistance(query, positions, 1, 0.5) : 0;
  if (cloud->distance_mm.value < apart_mm) {
    throw InputError(fmt::format(
        "trim.distance_mm: {} is less than what neighbouring points are apart ({:.3g} mm in the "
        "median), and the surface would fall to pieces; give several times that, or auto",
        cloud->distance_mm.value, apart_mm));
  }
}

std::optional<TrimmedTo> TrimOf(const Trim& trim, const FitResult& fit, int threads) {
  const auto* const cloud = std::get_if<CloudTrim>(&trim);
  if (cloud == nullptr) {
    return std::nullopt;
  }
  const std::vector<Vec3> places = PlacesOf(fit, threads);
  PointQuery query(places);
  const double distance_mm =
      cloud->distance_mm.automatic ? AutoDistance(query, places) : cloud->distance_mm.value;
  return TrimmedTo{std::move(query), distance_mm};
}

std::string TrimText(const TrimReport& r) {
  const double share = r.cut_mm2 / (r.kept_mm2 + r.cut_mm2);
  return fmt::format("trimmed to within {:.3g} mm of a point: {} of the surface is left out",
                     r.distance_mm, share > 0 ? fmt::format("{:.3g} %", 100 * share) : "nothing");
}

}  // namespace semblance
