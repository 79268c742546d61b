// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/parameters/parametrise.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "fitting/parameters/point_map.h"
#include "surfaces/base/error.h"
#include "surfaces/base/quantile.h"

namespace semblance::fitting {
namespace {

// Largest share of the points that may fold or collapse. Outliers and noise reach a few permille.
constexpr double kMostFaults = 0.02;

[[noreturn]] void FailParameters(const std::string& what) {
  throw InputError("parameters: " + what);
}

std::string PercentText(double share) { return fmt::format("{:.3g} %", 100 * share); }

// ---------------------------------------------------------------------- given

using Ranges = std::array<std::array<double, 2>, 2>;  // of u and v

// Returns what is wrong with a point's (u,v), or nothing.
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

// The option with the ranges widened so that they hold all the points.
std::string WiderRanges(std::span<const Vec2> uv, Ranges ranges) {
  for (const Vec2& p : uv) {
    for (const int c : {0, 1}) {
      ranges[c] = {std::fmin(ranges[c][0], p[c]), std::fmax(ranges[c][1], p[c])};
    }
  }
  return fmt::format("parameters: {{type: given, u_range: [{}, {}], v_range: [{}, {}]}}",
                     ranges[0][0], ranges[0][1], ranges[1][0], ranges[1][1]);
}

void CheckGiven(std::span<const Vec2> uv, const Ranges& ranges, const PointNames& name_of) {
  for (const auto& [low, high] : ranges) {
    if (!(high > low)) {
      FailParameters(
          fmt::format("the range [{}, {}] is empty; give the lower bound first", low, high));
    }
  }
  for (std::size_t k = 0; k < uv.size(); ++k) {
    if (const std::string fault = UvFault(uv[k], ranges); !fault.empty()) {
      throw InputError(fmt::format(
          "{} {}{}", name_of ? name_of(k) : fmt::format("point {}", k + 1), fault,
          uv[k].allFinite() ? fmt::format("; to take all points, write {}", WiderRanges(uv, ranges))
                            : ""));
    }
  }
}

// Refuses (u,v) on a line, which determine no surface.
void CheckSpread(std::span<const Vec2> uv) {
  constexpr double kOnLine = 1e-14;  // share of the mean squares, of round-off
  Vec2 mean = Vec2::Zero();
  for (const Vec2& p : uv) {
    mean += p / static_cast<double>(uv.size());
  }
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const Vec2& p : uv) {
    moments += (p - mean) * (p - mean).transpose();
  }
  const double trace = moments.trace();
  if (!(moments.determinant() > kOnLine * trace * trace)) {
    FailParameters(fmt::format(
        "the given (u,v) are all {}, so they determine no surface; give each point its own place, "
        "or leave the columns out",
        std::ranges::any_of(uv, [&](const Vec2& p) { return p != uv[0]; })
            ? "on one line"
            : fmt::format("({:.4g}, {:.4g})", uv[0].x(), uv[0].y())));
  }
}

// Refuses (u,v) that have nothing to do with the points, and those of several sheets at one place.
void CheckMeaning(const Scan& scan, FoldRule folds) {
  // Heights alone, twice as large as their noise, have 0.2, and 0.5 if the noise is as large.
  constexpr double kMostScatter = 0.85;
  constexpr double kMostMixed = 0.1;
  const double period = scan.closure == Closure::kPeriodicU ? 1 : 0;
  const PlaneMap map{scan.positions, scan.given_uv, period};
  if (NeighbourScatter(map) > kMostScatter) {
    FailParameters(
        "the given (u,v) do not belong to the points: neighbours in (u,v) lie as far apart in "
        "space "
        "as any points; a column that was sorted or shuffled apart from the others is the usual "
        "cause; restore the order of the rows, or leave the columns u and v out");
  }
  if (const double mixed = folds == FoldRule::kAccept ? 0 : MixedShare(map); mixed > kMostMixed) {
    FailParameters(fmt::format(
        "the given (u,v) bring several sheets of points to one place, at {} of the places; give "
        "each sheet (u,v) of its own, or fit it alone; parameters: {{type: given, folds: accept}} "
        "fits them all the same",
        PercentText(mixed)));
  }
}

// Returns whether u and v are linear in x and y, up to the rounding of a file with ten digits.
bool AreLinearInXy(const Scan& scan) {
  constexpr double kRounding = 1e-9;
  Mat3 normal = Mat3::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  Box3 box;
  for (const Vec3& p : scan.positions) {
    box.extend(p);
  }
  const Vec3 sizes = box.sizes();
  const auto row_of = [&](const Vec3& p) {
    return Vec3(1, (p.x() - box.min().x()) / sizes.x(), (p.y() - box.min().y()) / sizes.y());
  };
  if (!(sizes.x() > 0 && sizes.y() > 0)) {
    return false;
  }
  for (std::size_t k = 0; k < scan.positions.size(); ++k) {
    const Vec3 row = row_of(scan.positions[k]);
    normal += row * row.transpose();
    right += row * scan.given_uv[k].transpose();
  }
  const Eigen::Matrix<double, 3, 2> x = normal.fullPivLu().solve(right);
  for (std::size_t k = 0; k < scan.positions.size(); ++k) {
    const Vec2 off = x.transpose() * row_of(scan.positions[k]) - scan.given_uv[k];
    if (!(off.cwiseAbs().maxCoeff() < kRounding)) {
      return false;
    }
  }
  return std::abs(x.bottomRows<2>().determinant()) > kRounding;
}

Parametrisation ParametriseBy(Scan scan, const GivenParameters& given) {
  if (scan.given_uv.empty()) {
    FailParameters(
        "type 'given' needs the (u,v) of each point (the columns u and v of a table); give them, "
        "or take 'plane', 'cylinder' or 'mesh'");
  }
  const Ranges ranges = {given.u_range, given.v_range};
  CheckGiven(scan.given_uv, ranges, scan.name_of);
  for (Vec2& uv : scan.given_uv) {
    for (const int c : {0, 1}) {
      uv[c] = (uv[c] - ranges[c][0]) / (ranges[c][1] - ranges[c][0]);
    }
  }
  CheckSpread(scan.given_uv);
  CheckMeaning(scan, given.folds);
  const bool is_graph = scan.closure == Closure::kOpen && AreLinearInXy(scan);
  return {.uv = std::move(scan.given_uv), .source = ParameterSource::kGiven, .is_graph = is_graph};
}

// ----------------------------------------------------------- plane, cylinder, mesh

struct CheckedMap {
  PointMap map;
  MapFaults faults;
  std::string looked_at;  // all maps among which it was chosen, with their faults; for messages
  bool is_graph = false;  // of heights over x and y
};

// Root mean squares of the heights over a plane and of the places along its wider direction.
struct PlaneSpreads {
  double height_mm = 0, place_mm = 0;
};
PlaneSpreads MeasureSpreads(const Scan& scan, const PointMap& map) {
  double sum = 0, squares = 0, count = static_cast<double>(scan.positions.size());
  Vec2 places = Vec2::Zero();  // the mean place is 0
  for (std::size_t k = 0; k < scan.positions.size(); ++k) {
    const double height = (scan.positions[k] - scan.positions[0]).dot(map.normal);
    sum += height;
    squares += height * height;
    places += map.at[k].cwiseAbs2() / count;
  }
  return {std::sqrt(std::max(squares / count - sum / count * (sum / count), 0.0)),
          std::sqrt(places.maxCoeff())};
}

// The positions with their heights over the plane multiplied by `factor`.
std::vector<Vec3> WithHeights(const Scan& scan, const PointMap& map, double factor) {
  std::vector<Vec3> positions(scan.positions.begin(), scan.positions.end());
  for (Vec3& p : positions) {
    p += (factor - 1) * (p - scan.positions[0]).dot(map.normal) * map.normal;
  }
  return positions;
}

// The larger share of each fault, by the points and by the triangles if there are any.
// height_factor: of the heights over a plane; 1 leaves them as they are.
MapFaults FindFaults(const Scan& scan, const PointMap& map, double height_factor) {
  const std::vector<Vec2> in_mm = map.goes_round ? map.InMm() : std::vector<Vec2>();
  const std::vector<Vec3> scaled =
      height_factor == 1 ? std::vector<Vec3>() : WithHeights(scan, map, height_factor);
  const PlaneMap plane{scaled.empty() ? scan.positions : scaled, map.goes_round ? in_mm : map.at,
                       map.Period_mm()};
  const MapFaults by_points = FaultsOfPoints(plane);
  if (scan.triangles.empty()) {
    return by_points;
  }
  MapFaults by_triangles = FaultsOfTriangles(plane, scan.triangles);
  if (by_triangles.Sum() > kMostFaults) {
    const MapFaults beyond_noise = FaultsBeyondNoise(plane, scan.triangles);
    by_triangles = beyond_noise.Sum() < by_triangles.Sum() ? beyond_noise : by_triangles;
  }
  return {.folded = std::max(by_points.folded, by_triangles.folded),
          .collapsed = std::max(by_points.collapsed, by_triangles.collapsed),
          .mirrored = by_triangles.mirrored};
}

// The same. Heights that spread more than the plane are reduced to its spread: they may have
// another unit.
MapFaults FindFaults(const Scan& scan, const PointMap& map) {
  const PlaneSpreads spreads = MeasureSpreads(scan, map);
  return FindFaults(
      scan, map, spreads.height_mm > spreads.place_mm ? spreads.place_mm / spreads.height_mm : 1);
}

// The first map with next to no faults, or else the one with the fewest.
CheckedMap BestMap(const Scan& scan, const MapChoice& choice) {
  // Below this share of faulty points another map is not tried. It saves time: a map that does not
  // fold shows up to a permille or two by chance.
  constexpr double kNextToNone = 0.003;
  CheckedMap best;
  for (int k = 0; k < choice.count && (k == 0 || best.faults.Sum() > kNextToNone); ++k) {
    PointMap map = choice.make(k);
    const MapFaults faults = FindFaults(scan, map);
    best.looked_at +=
        fmt::format("{}{} of them over {}", k == 0 ? "" : ", ", PercentText(faults.Sum()), map.how);
    if (k == 0 || faults.Sum() < best.faults.Sum()) {
      best.map = std::move(map);
      best.faults = faults;
    }
  }
  return best;
}

bool MayBeTaken(const CheckedMap& map, FoldRule folds) {
  return map.is_graph || folds == FoldRule::kAccept || map.faults.Sum() <= kMostFaults;
}

// Brings one coordinate to 0..1. Returns its extent.
double Normalise(int coordinate, std::vector<Vec2>& uv) {
  double low = uv.front()[coordinate], high = low;
  for (const Vec2& p : uv) {
    low = std::min(low, p[coordinate]);
    high = std::max(high, p[coordinate]);
  }
  if (!(high > low)) {
    FailParameters(
        fmt::format("the points have no extent along {}; give other points, or the columns u and v "
                    "with parameters: given",
                    coordinate == 0 ? "u" : "v"));
  }
  for (Vec2& p : uv) {
    p[coordinate] = std::clamp((p[coordinate] - low) / (high - low), 0.0, 1.0);
  }
  return high - low;
}

Parametrisation Take(CheckedMap checked, ParameterSource source) {
  PointMap& map = checked.map;
  const bool is_graph = map.normal.x() == 0 && map.normal.y() == 0 && map.normal.z() != 0;
  for (Vec2& p : map.at) {
    p.x() = map.goes_round ? std::clamp(p.x(), 0.0, 1.0) : p.x();
    p.y() *= checked.faults.mirrored ? -1 : 1;  // so that du x dv faces as the triangles do
  }
  Vec2 lengths_mm = Vec2::Constant(kNaN);
  if (!map.goes_round) {
    lengths_mm.x() = Normalise(0, map.at);
  }
  lengths_mm.y() = Normalise(1, map.at);
  return {.uv = std::move(map.at),
          .source = source,
          .how = std::move(map.how),
          .faults = checked.faults,
          .lengths_mm = lengths_mm,
          .is_graph = is_graph};
}

[[noreturn]] void RefusePlanes(const CheckedMap& planes) {
  FailParameters(fmt::format(
      "the points fold over the plane: {}; give the columns u and v with parameters: given, or "
      "triangles between the points (a PLY, OBJ, STL or OFF with faces) with parameters: mesh, or, "
      "for a tube, take parameters: cylinder with closure: periodic_u; parameters: {{type: plane, "
      "folds: accept}} fits them all the same",
      planes.looked_at));
}

// The heights over a plane, as vectors along x.
std::vector<Vec3> HeightsAlongX(const Scan& scan, const PointMap& map) {
  std::vector<Vec3> heights;
  for (const Vec3& p : scan.positions) {
    heights.emplace_back((p - scan.positions[0]).dot(map.normal), 0, 0);
  }
  return heights;
}

// Returns how much of the heights over a plane neighbours do not share (NeighbourScatter).
double HeightScatter(const Scan& scan, const PointMap& map) {
  return NeighbourScatter({HeightsAlongX(scan, map), map.at});
}

// Returns whether neighbours share the heights over a plane, or most neighbours do.
bool ShareHeights(const Scan& scan, const PointMap& map) {
  // Trades noise as large as the relief (0.5), which passes, for shells and solids (0.8 to 1),
  // which do not.
  constexpr double kMostScatter = 0.7;
  // Trades 30 % of gross errors (0.01), which pass, for solids and two sheets (about 1).
  constexpr double kMostScatterOfMost = 0.1;
  constexpr std::size_t kFewest = 68;  // four neighbourhoods; of fewer each has most of the points
  if (scan.positions.size() < kFewest) {
    return true;
  }
  const std::vector<Vec3> heights = HeightsAlongX(scan, map);
  return NeighbourScatter({heights, map.at}) <= kMostScatter ||
         ScatterOfMostHeights({heights, map.at}) <= kMostScatterOfMost;
}

// Returns whether the points have no height over the plane: the heights spread like the places, and
// neighbours share nothing of them, as with coordinates in different units.
bool IsCloud(const Scan& scan, const PointMap& map) {
  constexpr double kLeastHeight = 0.1;  // of the narrower direction of the places
  constexpr double kMostScatter = 0.5;
  Vec2 places = Vec2::Zero();
  for (const Vec2& at : map.at) {
    places += at.cwiseAbs2() / static_cast<double>(map.at.size());
  }
  return MeasureSpreads(scan, map).height_mm > kLeastHeight * std::sqrt(places.minCoeff()) &&
         HeightScatter(scan, map) > kMostScatter;
}

// States that the heights over a plane are far larger than the plane; empty if they are not.
std::string UnitsText(const PlaneSpreads& spreads) {
  constexpr double kFarLarger = 10;  // also of steep terrain
  return spreads.height_mm > kFarLarger * spreads.place_mm
             ? fmt::format(
                   ", over which heights spread {:.2g} times as far as the points along it, "
                   "as coordinates in different units do",
                   spreads.height_mm / spreads.place_mm)
             : "";
}

// A plane across a coordinate axis over which the points have heights; `best` if there is none.
CheckedMap PlaneWithHeights(const Scan& scan, const MapChoice& planes, CheckedMap best) {
  constexpr double kMostScatter = 0.25;
  for (int k = 1; k < planes.count; ++k) {
    CheckedMap next{.map = planes.make(k), .faults = {}, .looked_at = best.looked_at};
    next.faults = FindFaults(scan, next.map);
    if (next.faults.Sum() <= kMostFaults && HeightScatter(scan, next.map) < kMostScatter) {
      return next;
    }
  }
  return best;
}

// Returns whether x and y spread over an area.
bool SpreadOverXy(std::span<const Vec3> positions) {
  constexpr double kOnLine = 1e-12;  // share of the product of the variances, above round-off
  const Vec3 origin = positions[0];
  Vec2 mean = Vec2::Zero();
  for (const Vec3& p : positions) {
    mean += (p - origin).head<2>() / static_cast<double>(positions.size());
  }
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const Vec3& p : positions) {
    const Vec2 off = (p - origin).head<2>() - mean;
    moments += off * off.transpose();
  }
  return moments.determinant() > kOnLine * moments(0, 0) * moments(1, 1);
}

// The plane across z, if the points are heights over x and y: neighbours over x and y have similar
// heights, and next to none of them fold. Heights count by their shape alone. Names of columns that
// mean a map need less evidence.
std::optional<CheckedMap> HeightsOverXy(const Scan& scan, const MapChoice& planes) {
  // Spread of the heights relative to the places. Higher values find closer sheets, and more folds
  // in rough terrain where there are none.
  constexpr double kHeightShare = 0.35;
  constexpr double kMostFaultsOfMap = 0.1;
  constexpr int kAcrossZ = 1;
  if (!SpreadOverXy(scan.positions)) {
    return std::nullopt;
  }
  CheckedMap map{.map = planes.make(kAcrossZ), .faults = {}, .looked_at = {}, .is_graph = true};
  const PlaneSpreads spreads = MeasureSpreads(scan, map.map);
  const double factor =
      spreads.height_mm > 0 ? kHeightShare * spreads.place_mm / spreads.height_mm : 1;
  map.faults = FindFaults(scan, map.map, factor);
  const bool is_found = scan.has_map_columns
                            ? map.faults.Sum() <= kMostFaultsOfMap
                            : map.faults.Sum() <= kMostFaults && ShareHeights(scan, map.map);
  return is_found ? std::optional(std::move(map)) : std::nullopt;
}

CheckedMap BestPlane(const Scan& scan, const PlaneParameters& plane) {
  const MapChoice planes = PlanesOver(scan.positions, Vec3(plane.normal.data()));
  if (planes.count > 1) {
    if (std::optional<CheckedMap> graph = HeightsOverXy(scan, planes)) {
      return std::move(*graph);
    }
  }
  CheckedMap best = BestMap(scan, planes);
  if (planes.count > 1 && IsCloud(scan, best.map)) {
    best = PlaneWithHeights(scan, planes, std::move(best));
  }
  best.map.how += UnitsText(MeasureSpreads(scan, best.map));
  return best;
}

Parametrisation ParametriseBy(const Scan& scan, const PlaneParameters& plane) {
  CheckedMap best = BestPlane(scan, plane);
  if (!MayBeTaken(best, plane.folds)) {
    RefusePlanes(best);
  }
  return Take(std::move(best), ParameterSource::kPlane);
}

constexpr std::string_view kOtherThanCylinder =
    "give another axis, cut off what closes the ends, or give the columns u and v with parameters: "
    "given; parameters: {type: cylinder, folds: accept} fits them all the same";

void CheckEnds(const Scan& scan, const CylinderAxis& axis) {
  if (const CylinderEnds ends = FindEnds(scan.positions, axis); ends.Close()) {
    FailParameters(fmt::format(
        "the points close at an end of the cylinder, where their angle is not known: half of the "
        "last hundredth are within {:.3g} mm of the axis, half of all points within {:.3g} mm; {}",
        ends.narrower_mm, ends.all_mm, kOtherThanCylinder));
  }
}

// The cylinder along the axis, cut open, for a sheet that is bent round it. A zero axis is found.
std::optional<PointMap> OpenCylinder(std::span<const Vec3> points, const Vec3& axis) {
  return CutOpen(
      CylindersAround(points, axis.isZero(0) ? DirectionAcrossNormals(points) : axis).make(0));
}

MapChoice CylindersFor(const Scan& scan, const CylinderParameters& cylinder) {
  const Vec3 axis(cylinder.axis.data());
  if (scan.closure == Closure::kPeriodicU) {
    return CylindersAround(scan.positions, axis);
  }
  std::optional<PointMap> open = OpenCylinder(scan.positions, axis);
  if (!open) {
    FailParameters(
        "the points go round the cylinder without an empty sector of 20 degrees, in which the "
        "surface could end; write closure: periodic_u");
  }
  return {1, [open = std::move(*open)](int) { return open; }};
}

Parametrisation ParametriseBy(const Scan& scan, const CylinderParameters& cylinder) {
  CheckedMap best = BestMap(scan, CylindersFor(scan, cylinder));
  if (!MayBeTaken(best, cylinder.folds)) {
    FailParameters(fmt::format(
        "the points fold over the cylinder, or close at its ends, where their angle is not known: "
        "{}; {}",
        best.looked_at, kOtherThanCylinder));
  }
  if (cylinder.folds == FoldRule::kRefuse) {
    CheckEnds(scan, best.map.axis);
  }
  return Take(std::move(best), ParameterSource::kCylinder);
}

Parametrisation ParametriseBy(const Scan& scan, const MeshParameters& mesh) {
  if (scan.triangles.empty()) {
    FailParameters(
        "type 'mesh' needs triangles between the points; give a PLY, OBJ, STL or OFF with faces "
        "(MeshLab and CloudCompare make them from points), or the columns u and v with parameters: "
        "given");
  }
  MeshLayout layout = LayOut({.points = {scan.positions.begin(), scan.positions.end()},
                              .triangles = {scan.triangles.begin(), scan.triangles.end()}},
                             mesh.map);
  const std::string how = fmt::format("the mesh laid out by {}",
                                      EnumNames(layout.map)[static_cast<std::size_t>(layout.map)]);
  CheckedMap laid{.map = {.how = how, .at = std::move(layout.at)}, .faults = {}, .looked_at = {}};
  laid.faults = FindFaults(scan, laid.map);
  if (laid.faults.folded > kMostFaults) {  // a layout squeezes, which is no fault
    FailParameters(fmt::format("{} folds {} of it; take another map (mean_value does not fold)",
                               how, PercentText(laid.faults.folded)));
  }
  return Take(std::move(laid), ParameterSource::kMesh);
}

// ----------------------------------------------------------------------- auto

// The cylinder round which the points are bent as a sheet that does not close: they neither fold
// over it nor close at its ends, and lie at similar distances from it.
std::optional<CheckedMap> BentSheet(const Scan& scan) {
  // Trades sheets that are bent more unevenly than an ellipse of 3 : 1 for solids and shells.
  constexpr double kMostUneven = 0.4;  // interquartile range of the distances, over their median
  std::optional<PointMap> open = OpenCylinder(scan.positions, Vec3::Zero());
  if (!open) {
    return std::nullopt;
  }
  CheckedMap sheet{.map = std::move(*open), .faults = {}, .looked_at = {}};
  sheet.faults = FindFaults(scan, sheet.map);
  const CylinderAxis& axis = sheet.map.axis;
  std::vector<double> distances;
  for (const Vec3& p : scan.positions) {
    distances.push_back(axis.DistanceTo(p));
  }
  const double spread = Quantile(distances, 0.75) - Quantile(distances, 0.25);
  const bool is_sheet = sheet.faults.Sum() <= kMostFaults &&
                        spread < kMostUneven * Quantile(distances, 0.5) &&
                        !FindEnds(scan.positions, axis).Close();
  return is_sheet ? std::optional(std::move(sheet)) : std::nullopt;
}

Parametrisation ParametriseBy(Scan scan, const AutoParameters&) {
  if (!scan.given_uv.empty()) {
    return ParametriseBy(std::move(scan), GivenParameters{});
  }
  if (scan.closure == Closure::kPeriodicU) {
    return ParametriseBy(scan, CylinderParameters{});
  }
  CheckedMap plane = BestPlane(scan, {});
  if (MayBeTaken(plane, FoldRule::kRefuse)) {
    return Take(std::move(plane), ParameterSource::kPlane);
  }
  if (!scan.triangles.empty()) {
    return ParametriseBy(scan, MeshParameters{});
  }
  if (std::optional<CheckedMap> bent = BentSheet(scan)) {
    return Take(std::move(*bent), ParameterSource::kCylinder);
  }
  RefusePlanes(plane);
}

void CheckScan(const Scan& scan) {
  if (scan.positions.empty()) {
    FailParameters("there is no point; give some");
  }
  if (!scan.given_uv.empty() && scan.given_uv.size() != scan.positions.size()) {
    FailParameters(fmt::format("{} pairs (u,v) for {} points; give one per point, or none",
                               scan.given_uv.size(), scan.positions.size()));
  }
  const auto count = static_cast<std::int64_t>(scan.positions.size());
  for (const Triangle& t : scan.triangles) {
    for (const std::int32_t corner : t) {
      if (corner < 0 || corner >= count) {
        FailParameters(
            fmt::format("a triangle has the corner {}, and there are {} points", corner, count));
      }
    }
  }
}

}  // namespace

Parametrisation Parametrise(Scan scan, const Parameters& parameters) {
  CheckScan(scan);
  return std::visit([&](const auto& chosen) { return ParametriseBy(std::move(scan), chosen); },
                    parameters);
}

Parametrisation Parametrise(std::span<const Vec3> positions, const Parameters& parameters,
                            std::span<const Vec2> given_uv) {
  return Parametrise({.positions = positions, .given_uv = {given_uv.begin(), given_uv.end()}},
                     parameters);
}

}  // namespace semblance::fitting
