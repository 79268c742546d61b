// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/points/point_notes.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "problems/points/file_parts.h"
#include "problems/report/plain_names.h"

namespace semblance::problems {
namespace {

std::string LeftOutText(const PointsOut& out) {
  constexpr std::size_t kMostNamed = 5;
  std::string named;
  for (std::size_t n = 0; n < std::min(out.strays.size(), kMostNamed); ++n) {
    named += fmt::format("{}{}", n > 0 ? ", " : "", out.strays[n] + 1);
  }
  return fmt::format(
      "{} far beyond all others {} left out: {} {}{}", Counted(std::ssize(out.strays), "point"),
      out.strays.size() == 1 ? "was" : "were", out.strays.size() == 1 ? "number" : "numbers", named,
      out.strays.size() > kMostNamed ? ", ..." : "");
}

// States that the points lie in two places, if there is a wide gap along u or v.
std::string GapText(std::vector<Vec2> uv) {
  constexpr double kWideGap = 0.4;     // of the domain
  constexpr std::size_t kOneIn = 100;  // points that lie beyond the gap at least
  for (const int c : {0, 1}) {
    std::ranges::sort(uv, {}, [&](const Vec2& p) { return p[c]; });
    for (std::size_t k = uv.size() / kOneIn; k + uv.size() / kOneIn < uv.size(); ++k) {
      if (k > 0 && uv[k][c] - uv[k - 1][c] > kWideGap) {
        return fmt::format(
            "the points lie in two places, with {:.0f} % of {} between them empty: nothing holds "
            "the surface there; fit each place by itself for its detail",
            100 * (uv[k][c] - uv[k - 1][c]), c == 0 ? "u" : "v");
      }
    }
  }
  return "";
}

// Least squares of z = a x + b y + c over a sample.
struct Trend {
  Vec2 slope = Vec2::Zero();
  double explained = 0;  // share of the variance of z
};
Trend FindTrend(std::span<const Vec3> positions) {
  constexpr std::size_t kMost = 20'000;  // points; more take more time
  std::vector<Vec3> sample;
  Vec3 mean = Vec3::Zero();
  for (std::size_t k = 0; k < positions.size(); k += positions.size() / kMost + 1) {
    sample.push_back(positions[k]);
    mean += positions[k];
  }
  mean /= static_cast<double>(sample.size());
  Mat3 moments = Mat3::Zero();
  for (const Vec3& p : sample) {
    moments += (p - mean) * (p - mean).transpose();
  }
  const Vec2 with_z = moments.col(2).head<2>();
  const Eigen::Matrix2d of_xy = moments.topLeftCorner<2, 2>();
  const Vec2 slope = of_xy.ldlt().solve(with_z);
  return {slope, slope.dot(with_z) / moments(2, 2)};
}

// States that points which were taken as heights over x and y may be a scan in another pose: they
// lie along a steep plane. Noise and detail count along z, and are magnified there. Beyond 80
// degrees z has another unit.
std::string SteepText(const PointTable& table, const PreparedPoints& placed) {
  constexpr double kLeastExplained = 0.8, kSteepest = 5.67;
  if (!placed.parameters.is_graph || table.has_map_columns ||
      placed.parameters.source != ParameterSource::kPlane) {
    return "";
  }
  const Trend trend = FindTrend(table.positions);
  const double slope = trend.slope.norm();
  if (!(trend.explained > kLeastExplained && slope > 1 && slope < kSteepest)) {
    return "";
  }
  const Vec3 normal = Vec3(-trend.slope.x(), -trend.slope.y(), 1).normalized();
  return fmt::format(
      "the points rise along a plane that is tilted by {:.0f} degrees, and are taken as heights z "
      "over x and y; if z has the unit of x and y, as in a scan, parameters: {{type: plane, "
      "normal: "
      "[{:.3g}, {:.3g}, {:.3g}]}} fits them more closely",
      std::atan(slope) * 180 / std::numbers::pi, normal.x(), normal.y(), normal.z());
}

}  // namespace

std::vector<std::string> FindNotes(const PointTable& table, const PointsOut& out,
                                   const PreparedPoints& placed, const PointFitOptions& options) {
  std::vector<std::string> notes = table.notes;
  if (out.not_finite > 0) {
    notes.push_back(fmt::format("{} without finite coordinates left out",
                                Counted(static_cast<long long>(out.not_finite), "point")));
  }
  if (!out.strays.empty()) {
    notes.push_back(LeftOutText(out));
  }
  if (const HSplineShape asked = ShapeFor(options);
      placed.shape.patches_u != asked.patches_u || placed.shape.patches_v != asked.patches_v) {
    notes.push_back(fmt::format(
        "level 0 has {} x {} patches in place of {} x {}, by the shape of "
        "the domain; patches_by_shape: false keeps them",
        placed.shape.patches_u, placed.shape.patches_v, asked.patches_u, asked.patches_v));
  }
  for (std::string text : {SteepText(table, placed), FindPartInAnotherUnit(table.positions)}) {
    if (!text.empty()) {
      notes.push_back(std::move(text));
    }
  }
  if (options.closure == Closure::kOpen) {
    if (std::string gap = GapText(placed.parameters.uv); !gap.empty()) {
      notes.push_back(std::move(gap));
    }
  }
  if (placed.parameters.is_graph) {
    for (std::string& note : FindHeightMistakes(table.positions, placed.parameters.uv)) {
      notes.push_back(std::move(note));
    }
  }
  return notes;
}

}  // namespace semblance::problems
