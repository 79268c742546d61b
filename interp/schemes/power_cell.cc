// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/power_cell.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace semblance {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double Cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

const CellCorner& Next(const CellPolygon& polygon, std::size_t i) {
  return polygon[i + 1 < polygon.size() ? i + 1 : 0];
}

// What of the polygon has value(x) >= 0, for a linear value. Most have it everywhere: then false,
// and `clipped` is left alone.
template <class Value>
bool Clip(const CellPolygon& polygon, const Value& value, int edge, CellPolygon& clipped) {
  boost::container::small_vector<double, 24> at(polygon.size(), boost::container::default_init);
  double least = kInfinity;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    at[i] = value(polygon[i].at);
    least = std::min(least, at[i]);
  }
  if (least >= 0) {
    return false;
  }
  clipped.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = i + 1 < polygon.size() ? i + 1 : 0;
    const CellCorner &a = polygon[i], &b = polygon[next];
    if (at[i] >= 0) {
      clipped.push_back(a);
    }
    if ((at[i] >= 0) != (at[next] >= 0)) {
      const Vec2 between = a.at + at[i] / (at[i] - at[next]) * (b.at - a.at);
      clipped.push_back({between, at[i] >= 0 ? edge : a.edge});
    }
  }
  return true;
}

double TwiceAreaOf(const CellPolygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    twice += Cross(polygon[i].at, Next(polygon, i).at);
  }
  return twice;
}

double Furthest2(const CellPolygon& polygon) {
  double furthest2 = 0;
  for (const CellCorner& corner : polygon) {
    furthest2 = std::max(furthest2, corner.at.squaredNorm());
  }
  return furthest2;
}

// Those that may keep a part of the cell, also such as the point would swallow whole: the lowest of
// the linear functions is nowhere in the cell above the least of their largest values.
boost::container::small_vector<int, 48> OwnersIn(std::span<const PowerSite> sites,
                                                 const CellPolygon& cell) {
  boost::container::small_vector<double, 48> least(sites.size(), kInfinity);
  double bound = kInfinity;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    double most = 0;
    for (const CellCorner& corner : cell) {
      const double value = sites[k].At(corner.at);
      least[k] = std::min(least[k], value);
      most = std::max(most, value);
    }
    bound = std::min(bound, most);
  }
  boost::container::small_vector<int, 48> owners;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    if (least[k] <= bound) {
      owners.push_back(static_cast<int>(k));
    }
  }
  return owners;
}

// Where three sites have the same value, and that value; infinite where they do not meet inwards.
struct Meeting {
  Vec2 at = Vec2::Zero();
  double level = kInfinity;
};

Meeting MeetingOf(const PowerSite& a, const PowerSite& b, const PowerSite& c) {
  const Vec2 ab = b.place - a.place, bc = c.place - b.place;
  const double across = 2 * Cross(ab, bc);
  if (across == 0) {
    return {};
  }
  const double of_ab = b.distance2 - a.distance2, of_bc = c.distance2 - b.distance2;
  const Vec2 at((of_ab * bc.y() - of_bc * ab.y()) / across,
                (of_bc * ab.x() - of_ab * bc.x()) / across);
  const double level = b.At(at);
  return level >= 0 ? Meeting{at, level} : Meeting{};
}

// One of the parts that still border on each other. As the level rises from 0, the region where all
// values reach it shrinks from the cell, and its edges vanish one by one where their neighbours
// meet.
struct OpenPart {
  int site = kOpenEdge;
  Vec2 border;  // how far the border to the part before it has come
  Meeting end;  // of this part, if it is the next to vanish
};
using OpenParts = boost::container::small_vector<OpenPart, 24>;

class PartsTree {
 public:
  PartsTree(std::span<const PowerSite> sites, const CellPolygon& cell, SiteAreas& twice_area)
      : sites_(sites), twice_area_(twice_area) {
    for (std::size_t i = 0; i < cell.size(); ++i) {
      twice_area_[cell[i].edge] += Cross(cell[i].at, Next(cell, i).at);
      parts_.push_back({cell[i].edge, cell[i].at, {}});
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      FindEnd(i);
    }
  }

  bool Trace() {
    while (parts_.size() > 3) {
      const std::size_t i =
          std::ranges::min_element(parts_, {}, [](const auto& p) { return p.end.level; }) -
          parts_.begin();
      if (!Passes(parts_[i].end)) {
        return false;
      }
      Close(i);
    }
    if (parts_.size() < 3 || !Passes(parts_[0].end)) {
      return false;
    }
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      AddBorder(i, parts_[0].end.at);
    }
    return true;
  }

 private:
  std::size_t Before(std::size_t i) const { return (i > 0 ? i : parts_.size()) - 1; }
  std::size_t After(std::size_t i) const { return i + 1 < parts_.size() ? i + 1 : 0; }

  void FindEnd(std::size_t i) {
    parts_[i].end = MeetingOf(sites_[parts_[Before(i)].site], sites_[parts_[i].site],
                              sites_[parts_[After(i)].site]);
  }

  // No other site is lower there: none has a part between these.
  bool Passes(const Meeting& meeting) const {
    return std::isfinite(meeting.level) && std::ranges::all_of(sites_, [&](const PowerSite& site) {
             return site.At(meeting.at) >= meeting.level - 1e-9 * site.distance2;
           });
  }

  // The border between part i and the one before it reaches `to`.
  void AddBorder(std::size_t i, const Vec2& to) {
    const double twice = Cross(parts_[i].border, to);
    twice_area_[parts_[Before(i)].site] += twice;
    twice_area_[parts_[i].site] -= twice;
  }

  void Close(std::size_t i) {
    const Vec2 at = parts_[i].end.at;
    AddBorder(i, at);
    AddBorder(After(i), at);
    parts_[After(i)].border = at;
    parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t after = i < parts_.size() ? i : 0;
    FindEnd(Before(after));
    FindEnd(after);
  }

  std::span<const PowerSite> sites_;
  SiteAreas& twice_area_;
  OpenParts parts_;
};

}  // namespace

PowerCell::PowerCell(double reach) {
  polygons_[0] = {{{-reach, -reach}}, {{reach, -reach}}, {{reach, reach}}, {{-reach, reach}}};
  furthest2_ = Furthest2(polygons_[0]);
}

void PowerCell::Cut(const PowerSite& site, int edge) {
  const double edge4 = site.distance2 * site.distance2;  // 4 |place|^2 times its edge's distance^2
  if (edge4 > 4 * site.place.squaredNorm() * furthest2_) {
    return;  // beyond all corners
  }
  const int other = 1 - current_;
  const auto value = [&site](const Vec2& x) { return site.At(x); };
  if (Clip(polygons_[current_], value, edge, polygons_[other])) {
    current_ = other;
    furthest2_ = Furthest2(polygons_[current_]);
  }
}

bool FindPartsByTree(std::span<const PowerSite> sites, const CellPolygon& cell,
                     SiteAreas& twice_area) {
  twice_area.assign(sites.size(), 0);
  return PartsTree(sites, cell, twice_area).Trace();
}

void FindPartsByClipping(std::span<const PowerSite> sites, const CellPolygon& cell,
                         SiteAreas& twice_area) {
  twice_area.assign(sites.size(), 0);
  const auto owners = OwnersIn(sites, cell);
  CellPolygon part, spare;
  for (const int own : owners) {
    part = cell;
    for (const int other : owners) {
      if (other != own && !part.empty()) {
        const PowerSite &a = sites[own], &b = sites[other];
        const auto value = [&](const Vec2& x) { return b.At(x) - a.At(x); };
        if (Clip(part, value, other, spare)) {
          std::swap(part, spare);
        }
      }
    }
    twice_area[own] = TwiceAreaOf(part);
  }
}

void FindParts(std::span<const PowerSite> sites, const CellPolygon& cell, SiteAreas& twice_area) {
  if (!FindPartsByTree(sites, cell, twice_area)) {
    FindPartsByClipping(sites, cell, twice_area);
  }
}

}  // namespace semblance
