// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/dowel_placement.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/base/farthest_first.h"
#include "surfaces/base/random.h"

namespace semblance::problems {
namespace {

// Keeps the first n of `order`.
std::vector<bool> KeepFirst(const std::vector<std::size_t>& order, int n) {
  std::vector<bool> kept(order.size(), false);
  const std::size_t count = std::min(order.size(), static_cast<std::size_t>(n));
  for (std::size_t k = 0; k < count; ++k) {
    kept[order[k]] = true;
  }
  return kept;
}

// Orders the points farthest first, beginning with the point farthest from the mean of all.
std::vector<std::size_t> SpreadOrder(std::span<const Vec3> points) {
  const Vec3 mean = std::accumulate(points.begin(), points.end(), Vec3(Vec3::Zero())) /
                    static_cast<double>(std::max<std::size_t>(1, points.size()));
  const auto first =
      std::ranges::max_element(points, {}, [&](const Vec3& p) { return (p - mean).norm(); });
  return FarthestFirst(points, static_cast<std::size_t>(first - points.begin()), points.size());
}

std::vector<bool> Kept(const KeepAll&, std::span<const std::string> sites, std::span<const Vec3>) {
  return std::vector<bool>(sites.size(), true);
}

std::vector<bool> Kept(const KeepSpread& o, std::span<const std::string>,
                       std::span<const Vec3> points) {
  return KeepFirst(SpreadOrder(points), o.n);
}

std::vector<bool> Kept(const KeepNames& o, std::span<const std::string> sites,
                       std::span<const Vec3>) {
  std::vector<bool> kept;
  for (const std::string& site : sites) {
    kept.push_back(std::ranges::find(o.sites, site) != o.sites.end());
  }
  return kept;
}

std::vector<bool> Kept(const KeepRandom& o, std::span<const std::string> sites,
                       std::span<const Vec3>) {
  std::vector<std::size_t> order(sites.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  Random(o.random_seed).Shuffle(order);
  return KeepFirst(order, o.n);
}

// Limits the recursion of AreaInside: 14 halvings take a side of 100 mm to 6 micrometres.
constexpr int kMaxSplits = 14;

// The area of the triangle inside the ball. Triangles that the ball's surface may cut are split
// into four, until a piece is smaller than 1/16 of the ball's radius; that bounds the error to some
// percent.
double AreaInside(const Vec3& a, const Vec3& b, const Vec3& c, const Sphere& ball, int splits) {
  const Vec3 center = (a + b + c) / 3;
  const double reach = std::sqrt(std::max(
      {(a - center).squaredNorm(), (b - center).squaredNorm(), (c - center).squaredNorm()}));
  const double distance = (center - ball.center).norm();
  if (distance > ball.radius_mm + reach) {
    return 0;
  }
  const bool whole = distance + reach <= ball.radius_mm;
  if (whole || splits == 0 || reach < ball.radius_mm / 16) {
    return distance <= ball.radius_mm ? (b - a).cross(c - a).norm() / 2 : 0;
  }
  const Vec3 ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
  return AreaInside(a, ab, ca, ball, splits - 1) + AreaInside(ab, b, bc, ball, splits - 1) +
         AreaInside(ca, bc, c, ball, splits - 1) + AreaInside(ab, bc, ca, ball, splits - 1);
}

// The area inside the ball, by triangle: of each triangle that reaches into it, and of `first`.
std::map<int, double> AreasInside(const TriMesh& mesh, const MeshQuery& query, int first,
                                  const Sphere& ball) {
  std::map<int, double> areas = {{first, 0}};
  for (const int t : query.TrianglesNear(ball.center, ball.radius_mm)) {
    const auto& [a, b, c] = mesh.triangles[t];
    const double area =
        AreaInside(mesh.points[a], mesh.points[b], mesh.points[c], ball, kMaxSplits);
    if (area > 0) {
      areas[t] = area;
    }
  }
  return areas;
}

// Triangles are connected at shared points. Points outside the ball connect too, because all points
// of a coarse mesh may lie outside.
std::map<int, std::vector<int>> TrianglesByPoint(const TriMesh& mesh,
                                                 const std::map<int, double>& areas) {
  std::map<int, std::vector<int>> by_point;
  for (const auto& [t, area] : areas) {
    for (const auto p : mesh.triangles[t]) {
      by_point[p].push_back(t);
    }
  }
  return by_point;
}

Vec3 UnitNormal(const TriMesh& mesh, int t) {
  return TriangleAreaVector(mesh, mesh.triangles[t]).normalized();  // zero stays zero
}

// The beginning of a message about the file.
std::string FileLabel(const LandmarkFile& file) {
  return file.subject.empty() ? "landmarks" : fmt::format("landmarks of {}", file.subject);
}

Vec3 SnapToSkull(const LandmarkFile& file, const Landmark& landmark, const MeshPoint& nearest,
                 const PlaceOptions& options) {
  if (!(nearest.distance_mm <= options.max_distance_mm)) {
    throw InputError(fmt::format(
        "{}: site {} is {:.1f} mm from the skull, and at most {} mm are allowed "
        "(max_distance_mm); correct its point, or check that landmarks and skull share one frame",
        FileLabel(file), DescribeSite(landmark.site), nearest.distance_mm,
        options.max_distance_mm));
  }
  return nearest.position;
}

Vec3 DirectionAt(const LandmarkFile& file, const Landmark& landmark, const TriMesh& skull,
                 const MeshQuery& query, const MeshPoint& base, const PlaceOptions& options) {
  if (landmark.normal) {
    return Vec3(landmark.normal->data()).normalized();
  }
  const Vec3 normal =
      AveragedNormal(skull, query, base.triangle, {base.position, options.normal_radius_mm});
  if (normal.isZero()) {
    throw InputError(fmt::format(
        "{}: site {}: the skull's triangles within {} mm have no area, so they define no "
        "direction; give the landmark a normal, or increase normal_radius_mm",
        FileLabel(file), DescribeSite(landmark.site), options.normal_radius_mm));
  }
  return normal;
}

// Moves each landmark at random along the axes and lays it on the bone.
void AddNoise(const MeshQuery& skull, const PlaceOptions& options, UsedLandmarks& used) {
  Random random(options.random_seed);
  for (Landmark& landmark : used.file.landmarks) {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    const Vec3 moved = landmark.Position() + options.noise_mm * Vec3(x, y, z);
    landmark.MoveTo(skull.Closest(moved).position);
    landmark.normal.reset();  // it belonged to the bone at the former point
  }
  used.notes.push_back(fmt::format(
      "landmarks: each is moved at random by {} mm (sd along each axis) and laid on the bone",
      options.noise_mm));
}

void NoteMissingNames(const LandmarksKept& kept, std::span<const std::string> sites,
                      std::vector<std::string>& notes) {
  const auto* names = std::get_if<KeepNames>(&kept);
  for (const std::string& name : names ? names->sites : std::vector<std::string>()) {
    if (std::ranges::find(sites, name) == sites.end()) {
      notes.push_back(
          fmt::format("landmarks.keep: the subject has no landmark at {}", DescribeSite(name)));
    }
  }
}

void Keep(const LandmarkFile& all, const LandmarksKept& kept, UsedLandmarks& used) {
  std::vector<std::string> sites, left;
  std::vector<Vec3> points;
  for (const Landmark& landmark : all.landmarks) {
    sites.push_back(landmark.site);
    points.push_back(landmark.Position());
  }
  NoteMissingNames(kept, sites, used.notes);
  const std::vector<bool> stays = KeptSites(kept, sites, points);
  std::vector<Landmark> landmarks;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    if (stays[k]) {
      landmarks.push_back(used.file.landmarks[k]);
      left.push_back(sites[k]);
    }
  }
  used.file.landmarks = std::move(landmarks);
  if (left.size() < 3) {
    throw InputError(fmt::format("{}: landmarks.keep leaves {} of {}; at least three are needed",
                                 FileLabel(all), left.size(), sites.size()));
  }
  if (left.size() < sites.size()) {
    used.notes.push_back(fmt::format("landmarks: {} of {} are used: {}", left.size(), sites.size(),
                                     fmt::join(left, ", ")));
  }
}

}  // namespace

std::map<std::string, double> TurnsOfDowels(const LandmarkFile& file, const TriMesh& skull,
                                            const MeshQuery& query, const PlaceOptions& options) {
  std::map<std::string, double> turns_deg;
  for (const Landmark& landmark : file.landmarks) {
    if (!landmark.normal) {
      continue;
    }
    const MeshPoint base = query.Closest(landmark.Position());
    const Vec3 own =
        AveragedNormal(skull, query, base.triangle, {base.position, options.normal_radius_mm});
    if (own.isZero()) {
      continue;
    }
    const Vec3 direction = Vec3(landmark.normal->data()).normalized();
    const double turn_deg =
        std::atan2(own.cross(direction).norm(), own.dot(direction)) * 180 / std::numbers::pi;
    if (turn_deg > kMaxTurn_deg && !file.proposed) {
      throw InputError(
          fmt::format("{}: site {}: its direction is turned by {:.0f} degrees from the bone's own, "
                      "so the dowel "
                      "would run along the bone or into the head; at most {:.0f} are allowed; turn "
                      "it outwards, "
                      "or leave the direction out",
                      FileLabel(file), DescribeSite(landmark.site), turn_deg, kMaxTurn_deg));
    }
    turns_deg[landmark.site] = turn_deg;
  }
  return turns_deg;
}

std::vector<bool> KeptSites(const LandmarksKept& kept, std::span<const std::string> sites,
                            std::span<const Vec3> points) {
  return std::visit([&](const auto& o) { return Kept(o, sites, points); }, kept);
}

UsedLandmarks LandmarksInUse(const LandmarkFile& file, const MeshQuery& skull,
                             const PlaceOptions& options) {
  UsedLandmarks used{.file = file, .notes = {}};
  if (options.noise_mm > 0) {
    AddNoise(skull, options, used);
  }
  if (!std::holds_alternative<KeepAll>(options.keep)) {
    Keep(file, options.keep, used);
  }
  return used;
}

std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const PlaceOptions& options) {
  return PlaceDowels(file, skull, MeshQuery(skull), options);
}

std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const MeshQuery& query, const PlaceOptions& options) {
  std::vector<Dowel> dowels;
  for (const Landmark& landmark : file.landmarks) {
    const MeshPoint nearest = query.Closest(landmark.Position());
    Dowel dowel;
    dowel.site = landmark.site;
    dowel.base = SnapToSkull(file, landmark, nearest, options);
    dowel.direction = DirectionAt(file, landmark, skull, query, nearest, options);
    dowels.push_back(dowel);
  }
  return dowels;
}

Vec3 AveragedNormal(const TriMesh& mesh, const MeshQuery& query, int first, const Sphere& ball) {
  const std::map<int, double> area_inside = AreasInside(mesh, query, first, ball);
  const auto by_point = TrianglesByPoint(mesh, area_inside);
  const Vec3 facing = UnitNormal(mesh, first);
  const double least_cosine = facing.isZero() ? -2 : std::cos(80 * std::numbers::pi / 180);
  Vec3 sum = Vec3::Zero();
  std::vector<int> connected = {first};
  std::set<int> seen = {first};
  for (std::size_t next = 0; next < connected.size(); ++next) {
    sum += area_inside.at(connected[next]) * UnitNormal(mesh, connected[next]);
    for (const auto p : mesh.triangles[connected[next]]) {
      for (const int t : by_point.at(p)) {
        if (facing.dot(UnitNormal(mesh, t)) >= least_cosine && seen.insert(t).second) {
          connected.push_back(t);
        }
      }
    }
  }
  return sum.normalized();  // zero stays zero
}

}  // namespace semblance::problems
