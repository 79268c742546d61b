// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/extra_sites.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/config/config_reader.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

constexpr char kForms[] = "write [x, y, z] in mm, a landmark such as go_l, or several, as [n, rhi]";

std::optional<double> ReadNumber(const ConfigNode& node) {
  ConfigErrors errors;
  const FieldInfo any;
  double number = kNaN;
  ReadScalar(errors, {node, "", any}, number);
  return errors.size() == 0 ? std::optional(number) : std::nullopt;
}

std::optional<Vec3> ReadPoint(const ConfigNode& list) {
  Vec3 point;
  for (int axis = 0; list.items.size() == 3 && axis < 3; ++axis) {
    const std::optional<double> number = ReadNumber(list.items[axis]);
    if (!number) {
      return std::nullopt;
    }
    point[axis] = *number;
  }
  return list.items.size() == 3 ? std::optional(point) : std::nullopt;
}

// The names of sites in `nodes`, or the fault of one of them.
SitePlace ReadLandmarkNames(const std::vector<ConfigNode>& nodes) {
  SitePlace place;
  for (const ConfigNode& node : nodes) {
    if (!node.IsScalar() || ReadNumber(node)) {
      return {{}, {}, kForms};
    }
    if (const std::string complaint = SiteFault(node.text); !complaint.empty()) {
      return {{}, {}, complaint};
    }
    place.landmarks.push_back(node.text);
  }
  place.fault = nodes.empty() ? kForms : "";
  return place;
}

// True for the code of a pair without its side.
bool LacksSide(const std::string& name) { return IsSite(name + "_l"); }

}  // namespace

SitePlace ReadPlace(const ConfigNode& near) {
  if (near.IsScalar()) {
    return ReadLandmarkNames({near});
  }
  if (!near.IsList()) {
    return {{}, {}, kForms};
  }
  if (const std::optional<Vec3> point = ReadPoint(near)) {
    return {point, {}, ""};
  }
  return ReadLandmarkNames(near.items);
}

std::vector<OptionFault> SiteOptionFaults(const ExtraSites& sites) {
  std::vector<OptionFault> faults;
  for (const auto& [name, site] : sites) {
    const std::string complaint = SiteFault(name);
    const bool placed = site.uv || !site.near.IsNull();
    if (LacksSide(name)) {
      faults.push_back({name, complaint});
    } else if (!complaint.empty() && !placed) {
      faults.push_back({name, complaint + " (a site of your own needs `near` or `uv`)"});
    } else if (!placed && !site.depth && !site.direction && !site.hold) {
      faults.push_back(
          {name, "the site has no options; give `uv`, `near`, `depth`, `direction` or `hold`"});
    }
  }
  return faults;
}

bool IsHeld(const ExtraSites& sites, const std::string& site) {
  const auto found = sites.find(site);
  return found != sites.end() && found->second.hold;
}

Vec3 PointNear(const std::string& site, const ConfigNode& near, std::span<const SitePoint> given) {
  const SitePlace place = ReadPlace(near);
  if (place.point) {
    return *place.point;
  }
  std::vector<SitePoint> standard;
  std::ranges::copy_if(given, std::back_inserter(standard), IsStandardSite, &SitePoint::site);
  std::optional<SkullFit> average;
  Vec3 sum = Vec3::Zero();
  for (const std::string& landmark : place.landmarks) {
    const auto found = std::ranges::find(given, landmark, &SitePoint::site);
    if (found != given.end()) {
      sum += found->point;
      continue;
    }
    if (!IsStandardSite(landmark)) {
      throw InputError(
          fmt::format("sites.{}.near: {} is not among the landmarks; place it, or name another",
                      site, DescribeSite(landmark)));
    }
    average = average ? average : FitAverageSkull(standard);
    sum += average->Predicted(landmark);
  }
  return sum / static_cast<double>(place.landmarks.size());
}

}  // namespace semblance::problems
