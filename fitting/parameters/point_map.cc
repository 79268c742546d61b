// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/point_map.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

[[noreturn]] void FailMap(const std::string& what) { throw InputError("parameters: " + what); }

Vec3 MeanPoint(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) {
    sum += p;
  }
  return sum / static_cast<double>(points.size());
}

// Columns: the principal directions, the shortest first; each with its largest entry positive, so
// that no sign is left to chance.
struct PrincipalFrame {
  Mat3 axes;
  Vec3 spreads;  // mean squares along them, ascending
};

PrincipalFrame FindPrincipalFrame(std::span<const Vec3> points) {
  const Vec3 mean = MeanPoint(points);
  Mat3 moments = Mat3::Zero();
  for (const Vec3& x : points) {
    moments += (x - mean) * (x - mean).transpose() / static_cast<double>(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  PrincipalFrame frame{.axes = eigen.eigenvectors(), .spreads = eigen.eigenvalues()};
  for (int k = 0; k < 3; ++k) {
    Eigen::Index largest = 0;
    frame.axes.col(k).cwiseAbs().maxCoeff(&largest);
    frame.axes.col(k) *= frame.axes(largest, k) < 0 ? -1 : 1;
  }
  return frame;
}

using PlaneAxes = std::array<Vec3, 2>;  // directions of u and v, unit

PlaneAxes LeastSquaresPlane(std::span<const Vec3> points) {
  // Smallest share of the mean squares that is no round-off: points on a slanted line have 1e-16.
  constexpr double kRoundOff = 1e-14;
  const PrincipalFrame frame = FindPrincipalFrame(points);
  if (!(frame.spreads[1] > kRoundOff * frame.spreads[2])) {
    FailMap(
        "the points lie on a line and span no plane; give other points, or the columns u and v "
        "with parameters: given");
  }
  return {frame.axes.col(2), frame.axes.col(1)};
}

PlaneAxes PlaneAcross(const Vec3& normal) {
  const Vec3 unit = normal.normalized();
  Eigen::Index flattest = 0;
  unit.cwiseAbs().minCoeff(&flattest);
  const Vec3 axis = Vec3::Unit(flattest), u = (axis - axis.dot(unit) * unit).normalized();
  return {u, unit.cross(u)};
}

PointMap OnPlane(std::span<const Vec3> points, const PlaneAxes& axes, std::string how) {
  const Vec3 mean = MeanPoint(points);
  PointMap map{.how = std::move(how), .normal = axes[0].cross(axes[1])};
  map.at.reserve(points.size());
  for (const Vec3& p : points) {
    map.at.emplace_back((p - mean).dot(axes[0]), (p - mean).dot(axes[1]));
  }
  return map;
}

// The axis along `direction`, and how unevenly the points lie around it.
struct CandidateAxis {
  CylinderAxis axis;
  double unevenness = kNaN;  // variance of the distances over their mean square
};

// The offset of the axis from `mean`: the circle of least squares makes |x|^2 linear in its centre.
Vec3 CentreFrom(const Vec3& mean, const CylinderAxis& axis, std::span<const Vec3> points) {
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Vec3& p : points) {
    const Vec3 row((p - mean).dot(axis.across), (p - mean).dot(axis.third), 1);
    normal += row * row.transpose();
    right += row.head<2>().squaredNorm() * row;
  }
  const Vec3 circle = normal.ldlt().solve(right);
  return circle.allFinite() ? Vec3(circle[0] / 2 * axis.across + circle[1] / 2 * axis.third)
                            : Vec3::Zero();
}

CandidateAxis AxisAlong(const Vec3& direction, std::span<const Vec3> points) {
  CylinderAxis axis{.direction = direction.normalized()};
  Eigen::Index least = 0;
  axis.direction.cwiseAbs().minCoeff(&least);
  axis.across = axis.direction.cross(Vec3::Unit(least)).normalized();
  axis.third = axis.direction.cross(axis.across);
  const Vec3 mean = MeanPoint(points);
  axis.centre = mean + CentreFrom(mean, axis, points);
  double sum = 0, squares = 0;
  for (const Vec3& p : points) {
    const double r = axis.DistanceTo(p);
    sum += r;
    squares += r * r;
  }
  const double n = static_cast<double>(points.size());
  return {axis, 1 - sum / n * (sum / n) / (squares / n)};
}

std::vector<CandidateAxis> PrincipalAxes(std::span<const Vec3> points) {
  const PrincipalFrame frame = FindPrincipalFrame(points);
  std::vector<CandidateAxis> axes;
  for (const int k : {2, 1, 0}) {
    axes.push_back(AxisAlong(frame.axes.col(k), points));
  }
  std::ranges::stable_sort(axes, {}, &CandidateAxis::unevenness);
  return axes;
}

// The angle of (x, y) in turns, in 0..1.
double Turns(double y, double x) {
  const double turns = std::atan2(y, x) / (2 * std::numbers::pi);
  return turns < 0 ? std::min(turns + 1, 1.0) : turns;
}

PointMap OnCylinder(std::span<const Vec3> points, const CylinderAxis& axis) {
  PointMap map{.how = fmt::format("the cylinder along [{:.3g}, {:.3g}, {:.3g}]", axis.direction.x(),
                                  axis.direction.y(), axis.direction.z()),
               .goes_round = true,
               .axis = axis};
  map.at.reserve(points.size());
  double distances_mm = 0;
  for (const Vec3& p : points) {
    const Vec3 x = p - axis.centre;
    map.at.emplace_back(Turns(x.dot(axis.third), x.dot(axis.across)), x.dot(axis.direction));
    distances_mm += axis.DistanceTo(p);
  }
  map.unit_mm.x() = 2 * std::numbers::pi * (distances_mm / static_cast<double>(points.size()));
  return map;
}

// The widest sector without points and the next one, in turns.
struct AngleGaps {
  double widest = 0, end = kNaN;  // end: angle at which the widest one ends
  double next = 0;
};
AngleGaps FindGaps(std::span<const Vec2> at) {
  constexpr int kSectors = 1440;
  std::vector<bool> is_empty(kSectors, true);
  for (const Vec2& p : at) {
    is_empty[std::min(static_cast<int>(p.x() * kSectors), kSectors - 1)] = false;
  }
  const int first = static_cast<int>(std::ranges::find(is_empty, false) - is_empty.begin());
  AngleGaps gaps;
  for (int k = first, empty = 0; k <= first + kSectors; ++k) {  // from a sector with points
    if (is_empty[k % kSectors]) {
      ++empty;
      continue;
    }
    const double gap = static_cast<double>(empty) / kSectors;
    if (gap > gaps.widest) {
      gaps = {.widest = gap, .end = static_cast<double>(k) / kSectors, .next = gaps.widest};
    } else {
      gaps.next = std::max(gaps.next, gap);
    }
    empty = 0;
  }
  return gaps;
}

}  // namespace

double CylinderAxis::DistanceTo(const Vec3& p) const {
  return std::hypot((p - centre).dot(across), (p - centre).dot(third));
}

std::vector<Vec2> PointMap::InMm() const {
  std::vector<Vec2> in_mm = at;
  for (Vec2& p : in_mm) {
    p = p.cwiseProduct(unit_mm);
  }
  return in_mm;
}

MapChoice PlanesOver(std::span<const Vec3> points, const Vec3& normal) {
  if (!normal.allFinite()) {
    FailMap("the plane's normal is not finite; give three numbers");
  }
  if (!normal.isZero(0)) {
    return {1, [=](int) {
              return OnPlane(
                  points, PlaneAcross(normal),
                  fmt::format("the plane across [{}, {}, {}]", normal.x(), normal.y(), normal.z()));
            }};
  }
  return {4, [=](int k) {
            return k == 0 ? OnPlane(points, LeastSquaresPlane(points), "the plane of least squares")
                          : OnPlane(points, PlaneAcross(Vec3::Unit(3 - k)),
                                    fmt::format("the plane across {}", "xyz"[3 - k]));
          }};
}

MapChoice CylindersAround(std::span<const Vec3> points, const Vec3& axis) {
  if (!axis.allFinite()) {
    FailMap("the cylinder's axis is not finite; give three numbers");
  }
  std::vector<CandidateAxis> axes =
      axis.isZero(0) ? PrincipalAxes(points) : std::vector{AxisAlong(axis, points)};
  const int count = static_cast<int>(axes.size());
  return {count, [=](int k) { return OnCylinder(points, axes[static_cast<std::size_t>(k)].axis); }};
}

Vec3 DirectionAcrossNormals(std::span<const Vec3> points) {
  // Neighbours among some thousand points lie farther apart than the noise of most scans.
  constexpr std::size_t kPoints = 4000, kPlanes = 400, kNeighbours = 12;
  std::vector<Vec3> sample;
  for (std::size_t k = 0; k < points.size(); k += points.size() / kPoints + 1) {
    sample.push_back(points[k]);
  }
  const std::size_t neighbours = std::min(kNeighbours, sample.size());
  Mat3 across = Mat3::Zero();
  for (std::size_t k = 0; k < sample.size(); k += sample.size() / kPlanes + 1) {
    std::vector<Vec3> near = sample;
    std::ranges::nth_element(
        near, near.begin() + static_cast<std::ptrdiff_t>(neighbours) - 1, {},
        [&, centre = sample[k]](const Vec3& p) { return (p - centre).squaredNorm(); });
    near.resize(neighbours);
    const Vec3 normal = FindPrincipalFrame(near).axes.col(0);
    across += normal * normal.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Mat3>(across).eigenvectors().col(0);
}

std::optional<PointMap> CutOpen(PointMap cylinder) {
  // A gap of 20 degrees beyond chance. Columns of a regular scan leave gaps of equal widths.
  constexpr double kLeast = 20.0 / 360, kBeyondChance = 10, kWiderThanNext = 2;
  const AngleGaps gaps = FindGaps(cylinder.at);
  const double gap = gaps.widest;
  if (!(gap >= std::max(kLeast, kBeyondChance / static_cast<double>(cylinder.at.size())) &&
        gap > kWiderThanNext * gaps.next)) {
    return std::nullopt;
  }
  const double cut = gaps.end - gap / 2;
  for (Vec2& p : cylinder.at) {
    const double turns = p.x() - cut;
    p.x() = (turns - std::floor(turns)) * cylinder.unit_mm.x();
  }
  cylinder.unit_mm = Vec2::Ones();
  cylinder.goes_round = false;
  cylinder.how += fmt::format(", cut open where {:.0f} degrees are empty", 360 * gap);
  return cylinder;
}

CylinderEnds FindEnds(std::span<const Vec3> points, const CylinderAxis& axis) {
  constexpr std::size_t kFewest = 8;             // points at an end: fewer have no steady median
  std::vector<std::pair<double, double>> along;  // height and distance
  std::vector<double> distances;
  for (const Vec3& p : points) {
    distances.push_back(axis.DistanceTo(p));
    along.emplace_back((p - axis.centre).dot(axis.direction), distances.back());
  }
  const std::size_t count = std::min(points.size(), std::max(points.size() / 100, kFewest));
  const auto median_at_end = [&](const auto& before) {
    std::ranges::nth_element(along, along.begin() + static_cast<std::ptrdiff_t>(count) - 1, before);
    std::vector<double> at_end;
    for (const auto& [height, distance] : std::span(along).first(count)) {
      at_end.push_back(distance);
    }
    return UpperMedian(at_end);
  };
  const double low_mm = median_at_end(std::less()), high_mm = median_at_end(std::greater());
  return {.narrower_mm = std::min(low_mm, high_mm), .all_mm = UpperMedian(distances)};
}

bool CylinderEnds::Close() const {
  // Trades tubes that taper strongly, which are refused below it, for caps, which pass above it.
  constexpr double kNarrow = 0.2;
  return narrower_mm < kNarrow * all_mm;
}

}  // namespace semblance::fitting
