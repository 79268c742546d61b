// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/cylinder_parameters.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "fitting/parameters/around_axis.h"
#include "fitting/parameters/principal_frame.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

// The circle of least squares (Kasa) through the points as seen along the direction is its centre.
CylinderAxis AxisAlong(const Vec3& direction, std::span<const Vec3> points) {
  CylinderAxis axis{.direction = direction.normalized(), .across = {}, .third = {}, .centre = {}};
  const auto [across, third] = Across(axis.direction);
  axis.across = across;
  axis.third = third;
  const Vec3 mean = MeanPoint(points);
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Vec3& p : points) {
    const Vec3 row((p - mean).dot(axis.across), (p - mean).dot(axis.third), 1);
    normal += row * row.transpose();
    right += row.head<2>().squaredNorm() * row;
  }
  const Vec3 circle = normal.ldlt().solve(right);
  const bool found = circle.allFinite();
  axis.centre = mean;
  if (found) {
    axis.centre += circle[0] / 2 * axis.across + circle[1] / 2 * axis.third;
  }
  double sum = 0, squares = 0;
  for (const Vec3& p : points) {
    const double r =
        std::hypot((p - axis.centre).dot(axis.across), (p - axis.centre).dot(axis.third));
    sum += r;
    squares += r * r;
  }
  const double n = static_cast<double>(points.size());
  axis.unevenness = 1 - sum / n * (sum / n) / (squares / n);
  return axis;
}

// That which is given; or the principal ones, the evenest first.
std::vector<CylinderAxis> AxesFor(const CylinderParameters& cylinder,
                                  std::span<const Vec3> points) {
  const Vec3 given(cylinder.axis[0], cylinder.axis[1], cylinder.axis[2]);
  if (given.norm() > 0) {
    return {AxisAlong(given, points)};
  }
  const PrincipalFrame principal = PrincipalFrameOf(points);
  std::vector<CylinderAxis> axes;
  for (const int k : {2, 1, 0}) {
    axes.push_back(AxisAlong(principal.axes.col(k), points));
  }
  std::stable_sort(axes.begin(), axes.end(), [](const CylinderAxis& a, const CylinderAxis& b) {
    return a.unevenness < b.unevenness;
  });
  return axes;
}

// In turns and mm along the axis.
std::vector<Vec2> AroundAxis(const CylinderAxis& axis, std::span<const Vec3> positions) {
  std::vector<Vec2> around;
  around.reserve(positions.size());
  for (const Vec3& p : positions) {
    const Vec3 x = p - axis.centre;
    around.emplace_back(Turns(x.dot(axis.third), x.dot(axis.across)), x.dot(axis.direction));
  }
  return around;
}

double MeanRadius(const CylinderAxis& axis, std::span<const Vec3> positions) {
  double sum = 0;
  for (const Vec3& p : positions) {
    const Vec3 x = p - axis.centre;
    sum += std::hypot(x.dot(axis.third), x.dot(axis.across));
  }
  return sum / static_cast<double>(positions.size());
}

// Why the ends may not be taken; empty if they may. A ball has areas on its cylinder as any tube
// has, but at its poles no angle: there the points of an end lie at the axis.
std::string EndFault(const CylinderAxis& axis, std::span<const Vec3> positions) {
  constexpr std::size_t kFewest = 8;  // points at an end
  constexpr double kLeast = 0.2;      // distance from the axis at an end, of that of all points
  std::vector<std::pair<double, double>> along;  // with the distance from the axis
  std::vector<double> distances;
  for (const Vec3& p : positions) {
    const Vec3 x = p - axis.centre;
    distances.push_back(std::hypot(x.dot(axis.third), x.dot(axis.across)));
    along.emplace_back(x.dot(axis.direction), distances.back());
  }
  const std::size_t count = std::min(positions.size(), std::max(positions.size() / 100, kFewest));
  const auto median_at_end = [&](const auto& before) {
    std::ranges::nth_element(along, along.begin() + static_cast<std::ptrdiff_t>(count) - 1, before);
    std::vector<double> at_end;
    for (const auto& [height, distance] : std::span(along).first(count)) {
      at_end.push_back(distance);
    }
    return UpperMedian(at_end);
  };
  const double all_mm = UpperMedian(distances),
               narrower_mm = std::min(median_at_end(std::less()), median_at_end(std::greater()));
  if (narrower_mm >= kLeast * all_mm) {
    return "";
  }
  return fmt::format(
      "the points close at an end of the cylinder, where their angle is not known: half of the "
      "last hundredth are within {:.3g} mm of the axis, of all points within {:.3g} mm; cut off "
      "what closes the ends, or give the columns u and v with parameters: given; or write folds: "
      "accept",
      narrower_mm, all_mm);
}

MapCandidate OnCylinder(const CylinderAxis& axis, std::span<const Vec3> positions) {
  const double period_mm = 2 * std::numbers::pi * MeanRadius(axis, positions);
  MapCandidate cylinder{
      .how = fmt::format("the cylinder along [{:.3g}, {:.3g}, {:.3g}]", axis.direction.x(),
                         axis.direction.y(), axis.direction.z()),
      .at = AroundAxis(axis, positions),
      .period_mm = Vec2(period_mm, 0)};
  for (Vec2& p : cylinder.at) {
    p.x() *= period_mm;
  }
  return cylinder;
}

}  // namespace

TriedCylinder TryCylinders(const Scan& points, const CylinderParameters& cylinder) {
  const std::vector<CylinderAxis> axes = AxesFor(cylinder, points.positions);
  std::vector<MapCandidate> cylinders =
      ChooseCandidate(points, static_cast<int>(axes.size()),
                      [&](int k) { return OnCylinder(axes[k], points.positions); });
  if (!MayBeTaken(cylinders.back(), cylinder.folds)) {
    FailParameters(fmt::format(
        "the points fold over the cylinder, or close at its ends, where its angle is not known: "
        "{}; give another axis, cut off what closes the ends, or give the columns u and v with "
        "parameters: given; or write folds: accept",
        FaultsText(cylinders)));
  }
  const CylinderAxis& axis = axes[cylinders.back().number];
  return {.axis = axis,
          .over = std::move(cylinders.back()),
          .end_fault = EndFault(axis, points.positions)};
}

Parametrisation TakeCylinder(const Scan& points, const TriedCylinder& tried) {
  Parametrisation result{.uv = AroundAxis(tried.axis, points.positions),
                         .source = ParameterSource::kCylinder,
                         .how = tried.over.how,
                         .faults = tried.over.faults};
  for (Vec2& uv : result.uv) {
    uv.x() = std::clamp(uv.x(), 0.0, 1.0);
  }
  TurnToTriangles(tried.over.faults, 1, result.uv);
  Normalise(1, "the cylinder's axis", result.uv);
  return result;
}

Parametrisation ParametriseBy(const Scan& points, const CylinderParameters& cylinder) {
  const TriedCylinder tried = TryCylinders(points, cylinder);
  if (cylinder.folds != FoldRule::kAccept && !tried.end_fault.empty()) {
    FailParameters(tried.end_fault);
  }
  return TakeCylinder(points, tried);
}

}  // namespace semblance
