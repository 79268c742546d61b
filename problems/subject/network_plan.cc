// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/network_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "problems/config/config.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

using Area = std::array<std::string, 3>;
using Points = std::map<std::string, Vec3>;

bool Has(const Area& area, const std::string& site) {
  return std::ranges::find(area, site) != area.end();
}

Area Moved(Area area, const std::string& from, const std::string& to) {
  std::ranges::replace(area, from, to);
  return area;
}

// Twice the area, as a vector; nothing if a point is not known.
std::optional<Vec3> AreaVector(const Area& area, const Points& points) {
  std::array<Vec3, 3> p;
  for (int c = 0; c < 3; ++c) {
    const auto found = points.find(area[c]);
    if (found == points.end()) {
      return std::nullopt;
    }
    p[c] = found->second;
  }
  return Vec3((p[1] - p[0]).cross(p[2] - p[0]));
}

// 1 for an equilateral area, 0 for a degenerate area.
double Roundness(const Area& area, const Points& points) {
  const std::optional<Vec3> normal = AreaVector(area, points);
  if (!normal) {
    return 1;  // BuildNetwork drops such an area
  }
  double squares = 0;
  for (int c = 0; c < 3; ++c) {
    squares += (points.at(area[c]) - points.at(area[(c + 1) % 3])).squaredNorm();
  }
  return 2 * std::sqrt(3.0) * normal->norm() / squares;
}

class SiteRemover {
 public:
  SiteRemover(NetworkPlan& plan, const Points& points) : areas_(plan.areas), points_(points) {}

  void Remove(const std::string& site) {
    std::string best;
    double best_roundness = 0;
    for (const std::string& other : Neighbours(site)) {
      const double roundness = RoundnessAfter(site, other);
      if (roundness > best_roundness) {
        best_roundness = roundness;
        best = other;
      }
    }
    if (!best.empty()) {
      std::erase_if(areas_, [&](const Area& a) { return Has(a, site) && Has(a, best); });
      std::ranges::transform(areas_, areas_.begin(),
                             [&](const Area& a) { return Moved(a, site, best); });
    }
  }

 private:
  // The sites that share an area with the site, in the order of the areas.
  std::vector<std::string> Neighbours(const std::string& site) const {
    std::vector<std::string> sites;
    for (const Area& area : areas_) {
      for (const std::string& other : area) {
        if (Has(area, site) && other != site && std::ranges::find(sites, other) == sites.end()) {
          sites.push_back(other);
        }
      }
    }
    return sites;
  }

  long AreasWith(const std::string& a, const std::string& b) const {
    return std::ranges::count_if(areas_,
                                 [&](const Area& area) { return Has(area, a) && Has(area, b); });
  }

  bool OnBorder(const std::string& site) const {
    return std::ranges::any_of(
        Neighbours(site), [&](const std::string& other) { return AreasWith(site, other) == 1; });
  }

  // True if the network stays sound after the collapse: the common neighbours of both sites are
  // exactly those of the areas between them (the link condition), and a border site moves along the
  // border.
  bool IsSound(const std::string& site, const std::string& other) const {
    const std::vector<std::string> of_other = Neighbours(other);
    const auto shared = std::ranges::count_if(Neighbours(site), [&](const std::string& s) {
      return std::ranges::find(of_other, s) != of_other.end();
    });
    return shared == AreasWith(site, other) && (!OnBorder(site) || AreasWith(site, other) == 1);
  }

  // The roundness of the worst area that the collapse moves; 0 if the collapse is not sound, 1 if
  // no area moves.
  double RoundnessAfter(const std::string& site, const std::string& other) const {
    double worst = points_.contains(other) && IsSound(site, other) ? 1 : 0;
    for (const Area& area : areas_) {
      if (worst > 0 && Has(area, site) && !Has(area, other)) {
        const Area moved = Moved(area, site, other);
        const auto before = AreaVector(area, points_), after = AreaVector(moved, points_);
        const bool turns_over = before && after && !(before->dot(*after) > 0);
        worst = turns_over ? 0 : std::min(worst, Roundness(moved, points_));
      }
    }
    return worst;
  }

  std::vector<Area>& areas_;
  const Points& points_;
};

Area Sorted(Area area) {
  std::ranges::sort(area);
  return area;
}

void CheckAreas(const NetworkPlan& plan, const std::string& file) {
  std::set<Area> known;
  for (const Area& area : plan.areas) {
    const Area sorted = Sorted(area);
    if (std::ranges::adjacent_find(sorted) != sorted.end()) {
      throw InputError(
          fmt::format("{}: area [{}] names a site twice; an area needs three "
                      "different sites",
                      file, fmt::join(area, ", ")));
    }
    if (!known.insert(sorted).second) {
      throw InputError(
          fmt::format("{}: area [{}] appears twice; keep one", file, fmt::join(area, ", ")));
    }
  }
}

// An edge has one area at the border and two inside, which run along it in opposite directions.
void CheckEdges(const NetworkPlan& plan, const std::string& file) {
  std::map<std::array<std::string, 2>, Area> area_at;  // by the edge in its direction
  std::map<std::set<std::string>, int> areas;
  for (const Area& area : plan.areas) {
    for (int c = 0; c < 3; ++c) {
      const std::array<std::string, 2> edge = {area[c], area[(c + 1) % 3]};
      if (++areas[{edge[0], edge[1]}] > 2) {
        throw InputError(fmt::format("{}: more than two areas have the edge {} {}; leave one out",
                                     file, edge[0], edge[1]));
      }
      const auto [other, is_new] = area_at.emplace(edge, area);
      if (!is_new) {
        throw InputError(fmt::format(
            "{}: the areas [{}] and [{}] lie on the same side of the edge {} {}; write the sites "
            "of each area counter-clockwise as seen from outside",
            file, fmt::join(other->second, ", "), fmt::join(area, ", "), edge[0], edge[1]));
      }
    }
  }
}

void RefuseUnknownSites(const std::set<std::string>& named, const std::string& file,
                        const ExtraSites& further) {
  for (const std::string& site : named) {
    if (!IsSite(site) && !further.contains(site)) {
      throw InputError(
          fmt::format("{}: areas: {} (a name of your own must stand under `sites` too)", file,
                      SiteFault(site)));
    }
  }
}

void RefuseMissingSites(const std::set<std::string>& named, const std::string& file,
                        std::span<const Landmark> landmarks) {
  std::vector<std::string> missing;
  for (const Landmark& landmark : landmarks) {
    if (IsStandardSite(landmark.site) && !named.contains(landmark.site)) {
      missing.push_back(landmark.site);
    }
  }
  if (!missing.empty()) {
    throw InputError(fmt::format(
        "{}: no area names the landmarks {}: the file may have been cut short; add their areas, "
        "or state area_count in the file if they are left out on purpose",
        file, fmt::join(missing, ", ")));
  }
}

Area MirrorImage(const Area& area) {
  Area mirrored;
  std::ranges::transform(area, mirrored.begin(), MirroredSite);
  return Sorted(mirrored);
}

}  // namespace

std::vector<std::string> CheckNetworkSites(const NetworkPlan& plan,
                                           const std::filesystem::path& file,
                                           std::span<const Landmark> landmarks,
                                           const ExtraSites& further) {
  std::set<std::string> named;
  std::set<Area> areas;
  for (const Area& area : plan.areas) {
    named.insert(area.begin(), area.end());
    areas.insert(Sorted(area));
  }
  RefuseUnknownSites(named, file.string(), further);
  if (plan.area_count) {
    return {};
  }
  RefuseMissingSites(named, file.string(), landmarks);
  std::vector<std::string> alone;
  for (const Area& area : plan.areas) {
    if (!areas.contains(MirrorImage(area))) {
      alone.push_back(fmt::format("[{}]", fmt::join(area, ", ")));
    }
  }
  if (alone.empty() || 4 * alone.size() > plan.areas.size()) {
    return {};
  }
  return {
      fmt::format("{}: the areas {} have no mirror image among the others; the file may have "
                  "been cut short",
                  file.filename().string(), fmt::join(alone, " "))};
}

NetworkPlan ReadNetworkPlan(const std::filesystem::path& path) {
  NetworkPlan plan = ReadConfig<NetworkPlan>(path);
  if (plan.areas.empty()) {
    throw InputError(fmt::format("{}: areas: the list is empty; list the three sites of each area",
                                 path.string()));
  }
  if (plan.area_count && *plan.area_count != static_cast<int>(plan.areas.size())) {
    throw InputError(fmt::format(
        "{}: area_count is {}, and the file has {} areas: it was cut short, or area_count is "
        "wrong; copy the file again, or correct area_count",
        path.string(), *plan.area_count, plan.areas.size()));
  }
  CheckAreas(plan, path.string());
  CheckEdges(plan, path.string());
  return plan;
}

NetworkPlan WithoutSites(NetworkPlan plan, const std::set<std::string>& gone,
                         const std::map<std::string, Vec3>& points) {
  for (const std::string& site : gone) {
    if (points.contains(site)) {
      SiteRemover(plan, points).Remove(site);
    }
  }
  return plan;
}

}  // namespace semblance::problems
