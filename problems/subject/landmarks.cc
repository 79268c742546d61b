// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/landmarks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "problems/config/config.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Normals in files are rounded to a few digits; 1 % still rejects a vector that is no unit normal.
constexpr double kUnitTolerance = 0.01;

// Returns the enum value of that name, or nothing if there is none.
template <class Enum>
std::optional<Enum> Named(std::string_view name) {
  const auto names = EnumNames(Enum{});
  const auto found = std::ranges::find(names, name);
  return found == names.end() ? std::nullopt
                              : std::optional(static_cast<Enum>(found - names.begin()));
}

// Sets the location that messages report for every node of a tree.
void SetLocation(const ConfigLocation& location, ConfigNode& tree) {
  tree.location = location;
  for (ConfigNode::Entry& entry : tree.entries) {
    SetLocation(location, entry.value);
  }
  for (ConfigNode& item : tree.items) {
    SetLocation(location, item);
  }
}

}  // namespace

template <class Report>
void CheckValue(Report& report, const Landmark& landmark) {
  if (const std::string complaint = SiteFault(landmark.site); !complaint.empty()) {
    report("site", complaint);
  }
  if (!landmark.Position().allFinite()) {
    report("point", "is missing; write [x, y, z] in mm");
  }
  if (landmark.normal) {
    const double length = Vec3(landmark.normal->data()).norm();
    if (!(std::abs(length - 1) <= kUnitTolerance)) {
      report("normal",
             fmt::format("has the length {:.4g}; it must be 1, or leave the normal out", length));
    }
  }
}

template <class Report>
void CheckValue(Report& report, const AbsentLandmark& absent) {
  if (const std::string complaint = SiteFault(absent.site); !complaint.empty()) {
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
                               "negated), not '{}'",
                               file.axes));
  }
  if (file.landmarks.empty()) {
    report("landmarks", "the list is empty; place at least one landmark");
  }
  std::set<std::string> sites;
  for (const Landmark& landmark : file.landmarks) {
    if (!sites.insert(landmark.site).second) {
      report("landmarks", fmt::format("site '{}' appears twice; keep one", landmark.site));
    }
  }
  for (const AbsentLandmark& absent : file.absent) {
    if (!sites.insert(absent.site).second) {
      report("absent", fmt::format("site '{}' appears twice in this file; keep one", absent.site));
    }
  }
}

const Landmark* LandmarkFile::Find(std::string_view site) const {
  const auto found = std::ranges::find(landmarks, site, &Landmark::site);
  return found == landmarks.end() ? nullptr : &*found;
}

std::vector<SitePoint> LandmarkFile::Points() const {
  std::vector<SitePoint> points;
  for (const Landmark& landmark : landmarks) {
    points.push_back({landmark.site, landmark.Position()});
  }
  return points;
}

LandmarkFile ReadLandmarkFileAsWritten(const std::filesystem::path& path) {
  return ReadConfig<LandmarkFile>(path);
}

void CheckLandmarks(std::span<const Landmark> landmarks, const std::string& file) {
  ConfigErrors errors;
  for (const Landmark& landmark : landmarks) {
    const ConfigSource source{.name = fmt::format("{}: site {}", file, DescribeSite(landmark.site)),
                              .folder = {},
                              .has_lines = false};
    ConfigNode tree = MakeConfigTree(landmark);
    SetLocation({std::make_shared<const ConfigSource>(source)}, tree);
    ReadConfigTree<Landmark>(tree, errors);
  }
  errors.ThrowIfAny();
}

LandmarkFile InLpsMm(LandmarkFile file) {
  const Axes axes = *Named<Axes>(file.axes);
  const LengthUnit unit = *Named<LengthUnit>(file.units);
  for (Landmark& landmark : file.landmarks) {
    landmark.MoveTo(ToLpsMm(landmark.Position(), axes, unit));
    if (landmark.normal) {
      const Vec3 normal = ToLps(Vec3(landmark.normal->data()), axes);
      landmark.normal = {normal.x(), normal.y(), normal.z()};
    }
  }
  file.axes = "LPS";
  file.units = "mm";
  return file;
}

}  // namespace semblance::problems
