// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "problems/config/config.h"
#include "problems/subject/averaged_normal.h"
#include "problems/subject/sites.h"
#include "surfaces/base/random.h"

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

// Each moved along the axes at random, and laid on the bone.
void Move(const MeshQuery& skull, const PlaceOptions& options, UsedLandmarks& used) {
  Random random(options.random_seed);
  for (Landmark& landmark : used.file.landmarks) {
    const double x = random.Normal(), y = random.Normal(), z = random.Normal();
    const Vec3 moved = ToVec3(landmark.point) + options.noise_mm * Vec3(x, y, z);
    landmark.point = ToArray(skull.Closest(moved).position);
    landmark.normal.reset();  // of the bone where it was
  }
  used.notes.push_back(fmt::format(
      "landmarks: each is moved at random by {} mm (sd along each axis) and laid on the bone",
      options.noise_mm));
}

void NoteNamesThatLack(const LandmarksKept& kept, std::span<const std::string> sites,
                       std::vector<std::string>& notes) {
  const auto* names = std::get_if<KeepNames>(&kept);
  for (const std::string& name : names ? names->sites : std::vector<std::string>()) {
    if (std::ranges::find(sites, name) == sites.end()) {
      notes.push_back(
          fmt::format("landmarks.keep: the subject has no landmark at {}", SiteInWords(name)));
    }
  }
}

void Keep(const LandmarkFile& all, const LandmarksKept& kept, UsedLandmarks& used) {
  std::vector<std::string> sites, left;
  std::vector<Vec3> points;
  for (const Landmark& landmark : all.landmarks) {
    sites.push_back(landmark.site);
    points.push_back(ToVec3(landmark.point));
  }
  NoteNamesThatLack(kept, sites, used.notes);
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
                                 OfSubject(all), left.size(), sites.size()));
  }
  if (left.size() < sites.size()) {
    used.notes.push_back(fmt::format("landmarks: {} of {} are used: {}", left.size(), sites.size(),
                                     fmt::join(left, ", ")));
  }
}

// Where messages say that all of a tree stands.
void Locate(const ConfigLocation& location, ConfigNode& tree) {
  tree.location = location;
  for (ConfigNode::Entry& entry : tree.entries) {
    Locate(location, entry.value);
  }
  for (ConfigNode& item : tree.items) {
    Locate(location, item);
  }
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
      report("landmarks", fmt::format("site '{}' appears twice; keep one", landmark.site));
    }
  }
  for (const AbsentLandmark& absent : file.absent) {
    if (!sites.insert(absent.site).second) {
      report("absent", fmt::format("site '{}' already stands in this file; keep one", absent.site));
    }
  }
}

LandmarkFile ReadLandmarkFileAsWritten(const std::filesystem::path& path) {
  return ReadConfig<LandmarkFile>(path);
}

void CheckLandmarks(std::span<const Landmark> landmarks, const std::string& file) {
  ConfigErrors errors;
  for (const Landmark& landmark : landmarks) {
    const ConfigSource source{.name = fmt::format("{}: site {}", file, SiteInWords(landmark.site)),
                              .folder = {},
                              .has_lines = false};
    ConfigNode tree = ConfigTreeOf(landmark);
    Locate({std::make_shared<const ConfigSource>(source)}, tree);
    ReadConfigTree<Landmark>(tree, errors);
  }
  errors.ThrowIfAny();
}

LandmarkFile InLpsMm(LandmarkFile file) {
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

UsedLandmarks LandmarksInUse(const LandmarkFile& file, const MeshQuery& skull,
                             const PlaceOptions& options) {
  UsedLandmarks used{.file = file, .notes = {}};
  if (options.noise_mm > 0) {
    Move(skull, options, used);
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
