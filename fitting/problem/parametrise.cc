// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/problem/parametrise.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <tuple>
#include <utility>

#include "fitting/problem/around_axis.h"
#include "fitting/problem/torus.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw InputError("parameters: " + what); }

constexpr double kMostFaults = 0.02;  // share of the points
constexpr double kNextToNone = 0.003;

Vec3 MeanOf(std::span<const Vec3> points) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : points) {
    sum += p;
  }
  return sum / static_cast<double>(points.size());
}

// Columns: principal directions, the shortest first; each with its largest entry positive, so that
// no sign is left to chance.
struct Principal {
  Vec3 mean;
  Mat3 axes;
  Vec3 spreads;  // mean squares along them, ascending
};

Principal PrincipalOf(std::span<const Vec3> points) {
  Principal p{.mean = MeanOf(points), .axes = {}, .spreads = {}};
  Mat3 moments = Mat3::Zero();
  for (const Vec3& x : points) {
    moments += (x - p.mean) * (x - p.mean).transpose() / static_cast<double>(points.size());
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(moments);
  p.axes = eigen.eigenvectors();
  p.spreads = eigen.eigenvalues();
  for (int k = 0; k < 3; ++k) {
    Eigen::Index at = 0;
    p.axes.col(k).cwiseAbs().maxCoeff(&at);
    p.axes.col(k) *= p.axes(at, k) < 0 ? -1 : 1;
  }
  return p;
}

// To 0..1.
void Normalise(int coordinate, const std::string& what, std::vector<Vec2>& uv) {
  double low = uv.front()[coordinate], high = low;
  for (const Vec2& p : uv) {
    low = std::min(low, p[coordinate]);
    high = std::max(high, p[coordinate]);
  }
  if (!(high > low)) {
    Fail(fmt::format("the points have no extent along {}; give (u,v), or other points", what));
  }
  for (Vec2& p : uv) {
    p[coordinate] = std::clamp((p[coordinate] - low) / (high - low), 0.0, 1.0);
  }
}

Parametrisation ParametersOf(const Scan& points, const GivenParameters& given) {
  if (points.given_uv.empty()) {
    Fail(
        "type 'given' needs each point's (u,v) (of a table, the columns u and v); give them, or "
        "take 'plane', 'cylinder', 'sphere' or 'torus'");
  }
  return TakeGiven({points.given_uv.begin(), points.given_uv.end()}, given, points.name_of);
}

// Directions of u and v, unit.
using PlaneAxes = std::array<Vec3, 2>;

PlaneAxes LeastSquaresPlane(std::span<const Vec3> positions) {
  constexpr double kRounding = 1e-14;  // of mean squares; points of a slanted line come to 1e-16
  const Principal principal = PrincipalOf(positions);
  if (!(principal.spreads[1] > kRounding * principal.spreads[2])) {
    Fail("the points lie on a line and span no plane; give (u,v), or other points");
  }
  return {principal.axes.col(2), principal.axes.col(1)};
}

PlaneAxes PlaneAcross(const Vec3& normal) {
  if (!normal.allFinite()) {
    Fail("the plane's normal is not finite; give three numbers");
  }
  const Vec3 unit = normal.normalized();
  Eigen::Index flattest = 0;
  unit.cwiseAbs().minCoeff(&flattest);
  const Vec3 axis = Vec3::Unit(flattest), u = (axis - axis.dot(unit) * unit).normalized();
  return {u, unit.cross(u)};
}

// A way to (u,v) that may be taken or not.
struct Candidate {
  std::string how;
  std::vector<Vec2> at;  // mm
  Vec2 period_mm = Vec2::Zero();
  MapFaults faults = {};
  int number = 0;  // among those that may be taken
};

MapFaults FaultsOf(const Scan& points, const Candidate& candidate) {
  const PlaneMap map{points.positions, candidate.at, candidate.period_mm};
  const MapFaults by_points = FaultsOfPoints(map);
  if (points.triangles.empty()) {
    return by_points;
  }
  const MapFaults by_triangles = FaultsOfTriangles(map, points.triangles);
  return {.folded = std::max(by_points.folded, by_triangles.folded),
          .collapsed = std::max(by_points.collapsed, by_triangles.collapsed),
          .mirrored = by_triangles.mirrored};
}

std::string Percent(double share) { return fmt::format("{:.3g} %", 100 * share); }

std::string FaultsText(const std::vector<Candidate>& tried) {
  std::string text;
  for (const Candidate& candidate : tried) {
    text += fmt::format("{}{} of them over {}", text.empty() ? "" : ", ",
                        Percent(candidate.faults.Sum()), candidate.how);
  }
  return text;
}

// The first that is next to faultless, else that with the least faults; all that were looked at
// come back, the chosen one last, the others without their places. make(k): the k-th of `count`.
template <class Make>
std::vector<Candidate> Choose(const Scan& points, int count, const Make& make) {
  std::vector<Candidate> tried;
  for (int k = 0; k < count && (k == 0 || tried.back().faults.Sum() > kNextToNone); ++k) {
    Candidate next = make(k);
    next.number = k;
    next.faults = FaultsOf(points, next);
    const bool better = k == 0 || next.faults.Sum() < tried.back().faults.Sum();
    const auto at = tried.insert(better ? tried.end() : tried.end() - 1, std::move(next));
    if (k > 0) {
      (better ? at - 1 : at)->at = {};
    }
  }
  return tried;
}

bool MayBeTaken(const Candidate& candidate, FoldRule folds) {
  return folds == FoldRule::kAccept || candidate.faults.Sum() <= kMostFaults;
}

Candidate OnPlane(std::span<const Vec3> positions, const PlaneAxes& axes, std::string how) {
  const Vec3 mean = MeanOf(positions);
  Candidate plane{.how = std::move(how), .at = {}};
  plane.at.reserve(positions.size());
  for (const Vec3& p : positions) {
    plane.at.emplace_back((p - mean).dot(axes[0]), (p - mean).dot(axes[1]));
  }
  return plane;
}

// Those of least squares, across z, y and x; or that which is asked for.
std::vector<Candidate> PlanesOver(const Scan& points, const PlaneParameters& plane) {
  const Vec3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
  if (!normal.isZero(0)) {
    return Choose(points, 1, [&](int) {
      return OnPlane(
          points.positions, PlaneAcross(normal),
          fmt::format("the plane across [{}, {}, {}]", normal.x(), normal.y(), normal.z()));
    });
  }
  return Choose(points, 4, [&](int k) {
    return k == 0 ? OnPlane(points.positions, LeastSquaresPlane(points.positions),
                            "the plane of least squares")
                  : OnPlane(points.positions, PlaneAcross(Vec3::Unit(3 - k)),
                            fmt::format("the plane across {}", "xyz"[3 - k]));
  });
}

// du x dv is to look where the triangles look.
void TurnToTriangles(const MapFaults& faults, int coordinate, std::vector<Vec2>& at) {
  for (Vec2& p : at) {
    p[coordinate] *= faults.mirrored ? -1 : 1;
  }
}

Parametrisation TakePlane(Candidate plane) {
  TurnToTriangles(plane.faults, 1, plane.at);
  Parametrisation result{.uv = std::move(plane.at),
                         .source = ParameterSource::kPlane,
                         .how = std::move(plane.how),
                         .faults = plane.faults};
  Normalise(0, "the plane's u", result.uv);
  Normalise(1, "the plane's v", result.uv);
  return result;
}

constexpr char kOtherWays[] =
    "give u and v, or triangles between the points (a PLY, OBJ, STL or OFF with faces) with "
    "parameters: mesh, or, for what goes round, parameters: cylinder or, if it is closed like a "
    "ball, sphere, with closure: periodic_u, or parameters: torus with closure: periodic_uv";

Parametrisation ParametersOf(const Scan& points, const PlaneParameters& plane) {
  std::vector<Candidate> planes = PlanesOver(points, plane);
  if (!MayBeTaken(planes.back(), plane.folds)) {
    Fail(fmt::format("the points fold over the plane: {}; {}; or write folds: accept",
                     FaultsText(planes), kOtherWays));
  }
  return TakePlane(std::move(planes.back()));
}

struct CylinderAxis {
  Vec3 direction, across, third, centre;
  double unevenness = kNaN;  // variance of the distances from the axis over their mean square
};

// The circle of least squares (Kasa) through the points as seen along the direction is its centre.
CylinderAxis AxisAlong(const Vec3& direction, std::span<const Vec3> points) {
  CylinderAxis axis{.direction = direction.normalized(), .across = {}, .third = {}, .centre = {}};
  const auto [across, third] = Across(axis.direction);
  axis.across = across;
  axis.third = third;
  const Vec3 mean = MeanOf(points);
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
  const Principal principal = PrincipalOf(points);
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

// The hundredth of the points at an end: medians of their distances from the axis, and from their
// own mean, which tells a tip that is off the axis from a ring.
struct CylinderEnd {
  double from_axis_mm = kNaN, from_mean_mm = kNaN;
};

struct CylinderRadii {
  std::array<CylinderEnd, 2> ends;
  double all_mm = kNaN;  // median of all points' distances from the axis

  double NarrowerEnd() const { return std::min(ends[0].from_axis_mm, ends[1].from_axis_mm); }
  // A ball has areas on its cylinder as any tube has, but at its poles no angle.
  bool Closes() const { return NarrowerEnd() < kLeast * all_mm; }
  bool AreBothTips() const {
    return std::max(ends[0].from_mean_mm, ends[1].from_mean_mm) < kRing * all_mm;
  }

 private:
  static constexpr double kLeast = 0.2, kRing = 0.5;
};

CylinderEnd EndOf(std::span<const std::tuple<double, double, std::uint32_t>> some,
                  std::span<const Vec3> positions) {
  std::vector<double> from_axis, from_mean;
  std::vector<Vec3> at_end;
  for (const auto& [along, distance, k] : some) {
    from_axis.push_back(distance);
    at_end.push_back(positions[k]);
  }
  const Vec3 mean = MeanOf(at_end);
  for (const Vec3& p : at_end) {
    from_mean.push_back((p - mean).norm());
  }
  return {UpperMedian(from_axis), UpperMedian(from_mean)};
}

CylinderRadii RadiiOf(const CylinderAxis& axis, std::span<const Vec3> positions) {
  std::vector<std::tuple<double, double, std::uint32_t>> along;  // the distance, and which point
  std::vector<double> distances;
  for (std::uint32_t k = 0; k < positions.size(); ++k) {
    const Vec3 x = positions[k] - axis.centre;
    distances.push_back(std::hypot(x.dot(axis.third), x.dot(axis.across)));
    along.emplace_back(x.dot(axis.direction), distances.back(), k);
  }
  constexpr std::size_t kFewest = 8;
  const std::size_t count = std::min(positions.size(), std::max(positions.size() / 100, kFewest));
  const auto end_of = [&](const auto& before) {
    std::ranges::nth_element(along, along.begin() + static_cast<std::ptrdiff_t>(count) - 1, before);
    return EndOf(std::span(along).first(count), positions);
  };
  const CylinderEnd low = end_of(std::less()), high = end_of(std::greater());
  return {{low, high}, UpperMedian(distances)};
}

[[noreturn]] void FailForEnds(const CylinderRadii& radii) {
  Fail(
      fmt::format("the points close at an end of the cylinder, where their angle is not known: "
                  "half of the last hundredth are within {:.3g} mm of the axis, of all points "
                  "within {:.3g} mm; take parameters: sphere if they are closed at both ends, cut "
                  "off what closes the ends, or give u and v; or write folds: accept",
                  radii.NarrowerEnd(), radii.all_mm));
}

Candidate OnCylinder(const CylinderAxis& axis, std::span<const Vec3> positions) {
  const double period_mm = 2 * std::numbers::pi * MeanRadius(axis, positions);
  Candidate cylinder{.how = fmt::format("the cylinder along [{:.3g}, {:.3g}, {:.3g}]",
                                        axis.direction.x(), axis.direction.y(), axis.direction.z()),
                     .at = AroundAxis(axis, positions),
                     .period_mm = Vec2(period_mm, 0)};
  for (Vec2& p : cylinder.at) {
    p.x() *= period_mm;
  }
  return cylinder;
}

// The best of those that may be taken, and whether its ends close.
struct TriedCylinder {
  CylinderAxis axis;
  Candidate best;
  CylinderRadii radii;
};

TriedCylinder TryCylinders(const Scan& points, const CylinderParameters& cylinder) {
  const std::vector<CylinderAxis> axes = AxesFor(cylinder, points.positions);
  std::vector<Candidate> cylinders = Choose(points, static_cast<int>(axes.size()), [&](int k) {
    return OnCylinder(axes[k], points.positions);
  });
  if (!MayBeTaken(cylinders.back(), cylinder.folds)) {
    Fail(fmt::format(
        "the points fold over the cylinder, or close at its ends, where its angle is not known: "
        "{}; give another axis, take parameters: sphere if they are closed at both ends, cut off "
        "what closes the ends, or give u and v; or write folds: accept",
        FaultsText(cylinders)));
  }
  const CylinderAxis& axis = axes[cylinders.back().number];
  return {axis, std::move(cylinders.back()), RadiiOf(axis, points.positions)};
}

Parametrisation TakeCylinder(const Scan& points, const TriedCylinder& tried) {
  Parametrisation result{.uv = AroundAxis(tried.axis, points.positions),
                         .source = ParameterSource::kCylinder,
                         .how = tried.best.how,
                         .faults = tried.best.faults};
  for (Vec2& uv : result.uv) {
    uv.x() = std::clamp(uv.x(), 0.0, 1.0);
  }
  TurnToTriangles(tried.best.faults, 1, result.uv);
  Normalise(1, "the cylinder's axis", result.uv);
  return result;
}

Parametrisation ParametersOf(const Scan& points, const CylinderParameters& cylinder) {
  const TriedCylinder tried = TryCylinders(points, cylinder);
  if (cylinder.folds != FoldRule::kAccept && tried.radii.Closes()) {
    FailForEnds(tried.radii);
  }
  return TakeCylinder(points, tried);
}

// Of the least and the greatest the one farther from the middle one. What is long or flat is most
// nearly round about it, and takes a quarter fewer vertices than about the others; how near the
// surface comes to the points, also at the poles, differs little.
Vec3 OddAxisOf(const Principal& principal) {
  const Vec3& s = principal.spreads;
  return principal.axes.col(s[2] * s[0] >= s[1] * s[1] ? 2 : 0);
}

PolarSphere SphereFor(const SphereParameters& asked, std::span<const Vec3> points,
                      const Principal& principal) {
  const Vec3 axis(asked.axis[0], asked.axis[1], asked.axis[2]);
  if (!axis.allFinite()) {
    Fail("the sphere's axis is not finite; give three numbers");
  }
  const PolarSphere sphere = SphereThrough(points, axis.isZero(0) ? OddAxisOf(principal) : axis);
  if (!sphere.centre.allFinite() || !(sphere.radius_mm > 0)) {
    Fail("no sphere goes near the points, which lie on a plane or in one place; give u and v");
  }
  return sphere;
}

// Why the points are no sphere; empty if they go all round.
std::string HoleFault(const PolarSphere& sphere, std::span<const Vec3> points, const Mat3& axes) {
  constexpr double kMostWidth = 0.8;  // of a cap of 45 degrees; of a tube with open ends 1
  const EmptyRay ray = WidestRay(
      sphere, points, std::array<Vec3, 4>{axes.col(0), axes.col(1), axes.col(2), sphere.axis});
  if (ray.Width() <= kMostWidth) {
    return "";
  }
  const std::string nearest = std::isfinite(ray.nearest_mm)
                                  ? fmt::format("no point is nearer than {:.3g} mm", ray.nearest_mm)
                                  : "no point lies on that side";
  return fmt::format(
      "the points do not go all round the centre of the sphere, [{:.4g}, {:.4g}, {:.4g}] mm: to "
      "the ray along [{:.2g}, {:.2g}, {:.2g}] {}, half of all are within {:.3g} mm of its line; "
      "take plane for an open surface, cylinder for a tube, or mesh, or give u and v",
      sphere.centre.x(), sphere.centre.y(), sphere.centre.z(), ray.direction.x(), ray.direction.y(),
      ray.direction.z(), nearest, ray.usual_mm);
}

Candidate OnSphere(const PolarSphere& sphere, std::vector<Vec2> angles) {
  const double half_round_mm = std::numbers::pi * sphere.radius_mm;
  Candidate over{
      .how = fmt::format("the sphere along [{:.3g}, {:.3g}, {:.3g}] about "
                         "[{:.4g}, {:.4g}, {:.4g}] of radius {:.4g} mm",
                         sphere.axis.x(), sphere.axis.y(), sphere.axis.z(), sphere.centre.x(),
                         sphere.centre.y(), sphere.centre.z(), sphere.radius_mm),
      .at = std::move(angles),
      .period_mm = Vec2(2 * half_round_mm, 0)};
  for (Vec2& p : over.at) {
    p = p.cwiseProduct(Vec2(2 * half_round_mm, half_round_mm));
  }
  return over;
}

struct TriedSphere {
  PolarSphere sphere;
  std::vector<Vec2> angles;
  Candidate over;
  std::string fault;  // why it may not be taken; empty if it may
};

TriedSphere TrySphere(const Scan& points, const SphereParameters& asked) {
  const Principal principal = PrincipalOf(points.positions);
  TriedSphere tried{.sphere = SphereFor(asked, points.positions, principal),
                    .angles = {},
                    .over = {},
                    .fault = {}};
  tried.fault = HoleFault(tried.sphere, points.positions, principal.axes);
  if (!tried.fault.empty()) {
    return tried;
  }
  tried.angles = AnglesAbout(tried.sphere, points.positions);
  tried.over = OnSphere(tried.sphere, tried.angles);
  tried.over.faults = FaultsOf(points, tried.over);
  if (!MayBeTaken(tried.over, asked.folds)) {
    tried.fault = fmt::format(
        "the points fold over the sphere, for rays from its centre meet them more than once: {}; "
        "cut the mesh open and take parameters: mesh, or give u and v; or write folds: accept",
        FaultsText({tried.over}));
  }
  return tried;
}

Parametrisation TakeSphere(const Scan& points, TriedSphere tried) {
  Poles poles = PolesOf(tried.sphere, points.positions, tried.angles);
  if (tried.over.faults.mirrored) {
    for (Vec2& p : tried.angles) {
      p.y() = 1 - p.y();
    }
    std::swap(poles[0], poles[1]);
  }
  return {.uv = std::move(tried.angles),
          .source = ParameterSource::kSphere,
          .how = std::move(tried.over.how),
          .faults = tried.over.faults,
          .poles = poles};
}

Parametrisation ParametersOf(const Scan& points, const SphereParameters& asked) {
  TriedSphere tried = TrySphere(points, asked);
  if (!tried.fault.empty()) {
    Fail(tried.fault);
  }
  return TakeSphere(points, std::move(tried));
}

// What ends in tips may be a sphere; a tube that is cut aslant is none, and stays a cylinder.
Parametrisation CylinderOrSphere(const Scan& points) {
  const TriedCylinder cylinder = TryCylinders(points, {});
  if (cylinder.radii.AreBothTips()) {
    if (TriedSphere sphere = TrySphere(points, {}); sphere.fault.empty()) {
      return TakeSphere(points, std::move(sphere));
    }
  }
  if (cylinder.radii.Closes()) {
    FailForEnds(cylinder.radii);
  }
  return TakeCylinder(points, cylinder);
}

// The widest part of a turn in which no value lies.
double WidestGap(std::vector<double> turns) {
  std::sort(turns.begin(), turns.end());
  double widest = turns.front() + 1 - turns.back();
  for (std::size_t k = 1; k < turns.size(); ++k) {
    widest = std::max(widest, turns[k] - turns[k - 1]);
  }
  return widest;
}

// A sphere, a tube or a cloud has a nearest torus too.
void CheckTorus(const Torus& torus, const std::vector<Vec2>& turns) {
  constexpr double kMostGap = 0.25, kMostOff = 0.35;  // turns, tube radii
  std::vector<double> u, v;
  for (const Vec2& p : turns) {
    u.push_back(p.x());
    v.push_back(p.y());
  }
  const double gap_u = WidestGap(std::move(u)), gap_v = WidestGap(std::move(v));
  const bool is_torus = torus.tube_mm > 0 && torus.ring_mm > torus.tube_mm &&
                        torus.median_off_mm < kMostOff * torus.tube_mm && gap_u < kMostGap &&
                        gap_v < kMostGap;
  if (!is_torus) {
    Fail(fmt::format(
        "the points are not a torus: the nearest has a ring of radius {:.4g} mm and a tube of "
        "{:.4g} mm, half of the points are more than {:.3g} mm off it, and its widest gaps are {} "
        "of a "
        "turn around the axis and {} around the ring; give another axis, or u and v",
        std::abs(torus.ring_mm), std::abs(torus.tube_mm), torus.median_off_mm, Percent(gap_u),
        Percent(gap_v)));
  }
}

Parametrisation ParametersOf(const Scan& points, const TorusParameters& asked) {
  const Vec3 axis(asked.axis[0], asked.axis[1], asked.axis[2]);
  if (!axis.allFinite()) {
    Fail("the torus's axis is not finite; give three numbers");
  }
  const Torus torus = TorusThrough(points.positions, axis);
  std::vector<Vec2> turns = TurnsAround(torus, points.positions);
  CheckTorus(torus, turns);
  Candidate best{.how = fmt::format(
                     "the torus around [{:.3g}, {:.3g}, {:.3g}] of radii {:.4g} and {:.4g} mm",
                     torus.axis.x(), torus.axis.y(), torus.axis.z(), torus.ring_mm, torus.tube_mm),
                 .at = turns,
                 .period_mm = 2 * std::numbers::pi * Vec2(torus.ring_mm, torus.tube_mm)};
  for (Vec2& p : best.at) {
    p = p.cwiseProduct(best.period_mm);
  }
  best.faults = FaultsOf(points, best);
  if (!MayBeTaken(best, asked.folds)) {
    Fail(
        fmt::format("the points fold over the torus: {}; give another axis, or u and v; or write "
                    "folds: accept",
                    FaultsText({best})));
  }
  for (Vec2& p : turns) {
    p.y() = best.faults.mirrored ? 1 - p.y() : p.y();
  }
  return {.uv = std::move(turns),
          .source = ParameterSource::kTorus,
          .how = best.how,
          .faults = best.faults};
}

void CheckTriangles(const Scan& points) {
  const auto count = static_cast<std::int64_t>(points.positions.size());
  for (const Triangle& t : points.triangles) {
    for (const std::int32_t corner : t) {
      if (corner < 0 || corner >= count) {
        Fail(fmt::format("a triangle has the corner {}, and there are {} points", corner, count));
      }
    }
  }
}

Parametrisation ParametersOf(const Scan& points, const MeshParameters& mesh) {
  if (points.triangles.empty()) {
    Fail(
        "type 'mesh' needs triangles between the points; give a PLY, OBJ, STL or OFF with faces, "
        "or take 'plane', 'cylinder' or 'sphere'");
  }
  MeshLayout layout = LayOut({.points = {points.positions.begin(), points.positions.end()},
                              .triangles = {points.triangles.begin(), points.triangles.end()}},
                             mesh.map);
  const std::string_view map = EnumNames(layout.map)[static_cast<std::size_t>(layout.map)];
  Candidate laid{.how = fmt::format("the mesh laid out by {}", map), .at = std::move(layout.at)};
  laid.faults = FaultsOf(points, laid);
  if (laid.faults.folded > kMostFaults) {
    Fail(fmt::format("{} folds {} of it; take another map (mean_value does not fold)", laid.how,
                     Percent(laid.faults.folded)));
  }
  Parametrisation result{.uv = std::move(laid.at),
                         .source = ParameterSource::kMesh,
                         .how = std::move(laid.how),
                         .faults = laid.faults};
  Normalise(0, "the mesh's u", result.uv);
  Normalise(1, "the mesh's v", result.uv);
  return result;
}

Parametrisation ParametersOf(const Scan& points, const AutoParameters&) {
  if (!points.given_uv.empty()) {
    return ParametersOf(points, GivenParameters{});
  }
  if (points.closure == Closure::kPeriodicUv) {
    return ParametersOf(points, TorusParameters{});
  }
  if (points.closure == Closure::kPeriodicU) {
    return CylinderOrSphere(points);
  }
  std::vector<Candidate> planes = PlanesOver(points, {});
  if (MayBeTaken(planes.back(), FoldRule::kRefuse)) {
    return TakePlane(std::move(planes.back()));
  }
  if (points.triangles.empty()) {
    Fail(fmt::format("the points fold over every plane: {}; {}", FaultsText(planes), kOtherWays));
  }
  return ParametersOf(points, MeshParameters{});
}

}  // namespace

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
      Fail(fmt::format("the range [{}, {}] is empty; give the lower bound first", low, high));
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

Parametrisation Parametrise(const Scan& scan, const Parameters& parameters) {
  if (scan.positions.empty()) {
    Fail("there is no point; give some");
  }
  if (!scan.given_uv.empty() && scan.given_uv.size() != scan.positions.size()) {
    Fail(fmt::format("{} pairs (u,v) for {} points; give one per point, or none",
                     scan.given_uv.size(), scan.positions.size()));
  }
  CheckTriangles(scan);
  return std::visit([&](const auto& p) { return ParametersOf(scan, p); }, parameters);
}

Parametrisation Parametrise(std::span<const Vec3> positions, const Parameters& parameters,
                            std::span<const Vec2> given_uv) {
  return Parametrise({.positions = positions, .given_uv = given_uv}, parameters);
}

}  // namespace semblance
