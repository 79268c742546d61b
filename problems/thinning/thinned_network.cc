// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/thinning/thinned_network.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace semblance {
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

// Twice the area, as a vector; nothing where a point is not known.
std::optional<Vec3> NormalOf(const Area& area, const Points& points) {
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

// 1 for an equilateral area, 0 for one without extent.
double ShapeOf(const Area& area, const Points& points) {
  const std::optional<Vec3> normal = NormalOf(area, points);
  if (!normal) {
    return 1;  // it falls away where the network is built
  }
  double squares = 0;
  for (int c = 0; c < 3; ++c) {
    squares += (points.at(area[c]) - points.at(area[(c + 1) % 3])).squaredNorm();
  }
  return 2 * std::sqrt(3.0) * normal->norm() / squares;
}

class Thinning {
 public:
  Thinning(NetworkPlan& plan, const Points& points) : areas_(plan.areas), points_(points) {}

  void Remove(const std::string& site) {
    std::string best;
    double best_shape = 0;
    for (const std::string& other : NeighboursOf(site)) {
      const double shape = ShapeAfter(site, other);
      if (shape > best_shape) {
        best_shape = shape;
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
  // In the order of the areas.
  std::vector<std::string> NeighboursOf(const std::string& site) const {
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
        NeighboursOf(site), [&](const std::string& other) { return AreasWith(site, other) == 1; });
  }

  // Whether the network is as sound after the collapse: the sites that neighbour both are those of
  // the areas between them (the link condition), and the border moves along itself.
  bool IsSound(const std::string& site, const std::string& other) const {
    const std::vector<std::string> of_other = NeighboursOf(other);
    const auto shared = std::ranges::count_if(NeighboursOf(site), [&](const std::string& s) {
      return std::ranges::find(of_other, s) != of_other.end();
    });
    return shared == AreasWith(site, other) && (!OnBorder(site) || AreasWith(site, other) == 1);
  }

  // The shape of the worst area that moves; 0 where the collapse is not sound, 1 where none moves.
  double ShapeAfter(const std::string& site, const std::string& other) const {
    double worst = points_.contains(other) && IsSound(site, other) ? 1 : 0;
    for (const Area& area : areas_) {
      if (worst > 0 && Has(area, site) && !Has(area, other)) {
        const Area moved = Moved(area, site, other);
        const auto before = NormalOf(area, points_), after = NormalOf(moved, points_);
        const bool turns = before && after && !(before->dot(*after) > 0);
        worst = turns ? 0 : std::min(worst, ShapeOf(moved, points_));
      }
    }
    return worst;
  }

  std::vector<Area>& areas_;
  const Points& points_;
};

}  // namespace

NetworkPlan WithoutSites(NetworkPlan plan, const std::set<std::string>& gone,
                         const std::map<std::string, Vec3>& points) {
  for (const std::string& site : gone) {
    if (points.contains(site)) {
      Thinning(plan, points).Remove(site);
    }
  }
  return plan;
}

}  // namespace semblance
