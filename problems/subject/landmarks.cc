// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "problems/config/config.h"
#include "problems/subject/averaged_normal.h"
#include "problems/subject/sites.h"

namespace semblance {
namespace {

constexpr double kUnitTolerance = 0.01;  // files hold rounded normals

// The value of that name, if there is one.
template <class Enum>
std::optional<Enum> Named(std::string_view name) {
  const auto names = EnumNames(Enum{});
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? std::nullopt
                              : std::optional(static_cast<Enum>(found - names.begin()));
}

Vec3 ToVec3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<double, 3> ToArray(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

std::string OfSubject(const LandmarkFile& file) {
  return file.subject.empty() ? "landmarks" : fmt::format("landmarks of {}", file.subject);
}

Vec3 SnapToSkull(const LandmarkFile& file, const Landmark& landmark, const MeshPoint& nearest,
                 const PlaceOptions& options) {
  if (!(nearest.distance_mm <= options.max_distance_mm)) {
    throw InputError(fmt::format(
        "{}: site {} is {:.1f} mm from the skull, and at most {} mm are allowed "
        "(max_distance_mm); correct its point, or check that landmarks and skull share one frame",
        OfSubject(file), SiteInWords(landmark.site), nearest.distance_mm, options.max_distance_mm));
  }
  return nearest.position;
}

Vec3 DirectionAt(const LandmarkFile& file, const Landmark& landmark, const TriMesh& skull,
                 const MeshPoint& base, const PlaceOptions& options) {
  if (landmark.normal) {
    return ToVec3(*landmark.normal).normalized();
  }
  const Vec3 normal =
      AveragedNormal(skull, base.triangle, {base.position, options.normal_radius_mm});
  if (normal.isZero()) {
    throw InputError(fmt::format(
        "{}: site {}: the skull's triangles within {} mm have no area, so they give no direction; "
        "give the landmark a normal, or increase normal_radius_mm",
        OfSubject(file), SiteInWords(landmark.site), options.normal_radius_mm));
  }
  return normal;
}

}  // namespace

template <class Report>
void CheckValue(Report& report, const Landmark& landmark) {
  if (const std::string complaint = ComplaintAboutLandmark(landmark.site); !complaint.empty()) {
    report("site", complaint);
  }
  if (!ToVec3(landmark.point).allFinite()) {
    report("point", "is not given; write [x, y, z] in mm");
  }
  if (landmark.normal) {
    const double length = ToVec3(*landmark.normal).norm();
    if (!(std::abs(length - 1) <= kUnitTolerance)) {
      report("normal",
             fmt::format("has the length {:.4g}; it must be 1, or leave the normal out", length));
    }
  }
}

template <class Report>
void CheckValue(Report& report, const AbsentLandmark& absent) {
  if (const std::string complaint = ComplaintAboutLandmark(absent.site); !complaint.empty()) {
    report("site", complaint);
  }
}

template <class Report>
void CheckValue(Report& report, const LandmarkFile& file) {
  if (!Named<LengthUnit>(file.units)) {
    report("units", fmt::format("must be one of {}, not '{}'",
                                fmt::join(EnumNames(LengthUnit{}), ", "), file.units));
  }
  if (!Named<Axes>(file.axes)) {
    report("axes", fmt::format("must be LPS (+x subject left, +y posterior, +z up) or RAS (x and y "
                               "the other way), not '{}'",
                               file.axes));
  }
  if (file.landmarks.empty()) {
    report("landmarks", "there is none; place at least one");
  }
  std::set<std::string> sites;
  for (const Landmark& landmark : file.landmarks) {
    if (!sites.insert(landmark.site).second) {
      report("landmarks", fmt::format("site '{}' stands twice; keep one", landmark.site));
    }
  }
  for (const AbsentLandmark& absent : file.absent) {
    if (!sites.insert(absent.site).second) {
      report("absent", fmt::format("site '{}' already stands in this file; keep one", absent.site));
    }
  }
}

LandmarkFile ReadLandmarkFile(const std::filesystem::path& path) {
  auto file = ReadConfig<LandmarkFile>(path);
  const Axes axes = *Named<Axes>(file.axes);
  const LengthUnit unit = *Named<LengthUnit>(file.units);
  for (Landmark& landmark : file.landmarks) {
    landmark.point = ToArray(ToLpsMm(ToVec3(landmark.point), axes, unit));
    if (landmark.normal) {
      landmark.normal = ToArray(ToLps(ToVec3(*landmark.normal), axes));
    }
  }
  file.axes = "LPS";
  file.units = "mm";
  return file;
}

std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const PlaceOptions& options) {
  return PlaceDowels(file, skull, MeshQuery(skull), options);
}

std::vector<Dowel> PlaceDowels(const LandmarkFile& file, const TriMesh& skull,
                               const MeshQuery& query, const PlaceOptions& options) {
  std::vector<Dowel> dowels;
  for (const Landmark& landmark : file.landmarks) {
    const MeshPoint nearest = query.Closest(ToVec3(landmark.point));
    Dowel dowel;
    dowel.site = landmark.site;
    dowel.base = SnapToSkull(file, landmark, nearest, options);
    dowel.direction = DirectionAt(file, landmark, skull, nearest, options);
    dowels.push_back(dowel);
  }
  return dowels;
}

}  // namespace semblance
