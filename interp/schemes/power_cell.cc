// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/power_cell.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace semblance::interp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double Cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

const CellCorner& Next(const CellPolygon& polygon, std::size_t i) {
  return polygon[i + 1 < polygon.size() ? i + 1 : 0];
}

// Clips the polygon to value(x) >= 0 for a linear value. Returns false, without setting `clipped`,
// if the whole polygon remains, which is the usual case.
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

double TwiceArea(const CellPolygon& polygon) {
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

// The sites that may lose a part of the cell. In the cell the lowest of the linear functions is
// nowhere above the smallest of their maxima, which excludes sites above this bound.
boost::container::small_vector<int, 48> FindContenders(std::span<const PowerSite> sites,
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
  boost::container::small_vector<int, 48> contenders;
  for (std::size_t k = 0; k < sites.size(); ++k) {
    if (least[k] <= bound) {
      contenders.push_back(static_cast<int>(k));
    }
  }
  return contenders;
}

// A vertex of the lower envelope: the point where three sites' functions are equal, and their value
// (level); infinite if they do not meet inside.
struct Vertex {
  Vec2 at = Vec2::Zero();
  double level = kInfinity;
};

Vertex EnvelopeVertex(const PowerSite& a, const PowerSite& b, const PowerSite& c) {
  const Vec2 ab = b.position - a.position, bc = c.position - b.position;
  const double across = 2 * Cross(ab, bc);
  if (across == 0) {
    return {};
  }
  const double of_ab = b.distance2 - a.distance2, of_bc = c.distance2 - b.distance2;
  const Vec2 at((of_ab * bc.y() - of_bc * ab.y()) / across,
                (of_bc * ab.x() - of_ab * bc.x()) / across);
  const double level = b.At(at);
  return level >= 0 ? Vertex{at, level} : Vertex{};
}

// As the level rises from 0, the region where all functions are above it shrinks from the whole
// cell. Each edge of the region belongs to one site and vanishes where its two neighbours meet.
struct ActiveEdge {
  int site = kOpenEdge;
  Vec2 start;  // where the edge met its predecessor at the current level
  Vertex end;  // where it vanishes, if it vanishes next
};
using ActiveEdges = boost::container::small_vector<ActiveEdge, 24>;

// Follows the envelope's edges upwards from the corners of the cell. They form a tree whose leaves
// are the corners.
class LowerEnvelopeTree {
 public:
  LowerEnvelopeTree(std::span<const PowerSite> sites, const CellPolygon& cell,
                    SiteAreas& twice_area)
      : sites_(sites), twice_area_(twice_area) {
    for (std::size_t i = 0; i < cell.size(); ++i) {
      twice_area_[cell[i].edge] += Cross(cell[i].at, Next(cell, i).at);
      edges_.push_back({cell[i].edge, cell[i].at, {}});
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      FindEnd(i);
    }
  }

  bool Trace() {
    while (edges_.size() > 3) {
      const std::size_t i =
          std::ranges::min_element(edges_, {}, [](const ActiveEdge& e) { return e.end.level; }) -
          edges_.begin();
      if (!Passes(edges_[i].end)) {
        return false;
      }
      Close(i);
    }
    if (edges_.size() < 3 || !Passes(edges_[0].end)) {
      return false;
    }
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      AddBorder(i, edges_[0].end.at);
    }
    return true;
  }

 private:
  std::size_t Before(std::size_t i) const { return (i > 0 ? i : edges_.size()) - 1; }
  std::size_t After(std::size_t i) const { return i + 1 < edges_.size() ? i + 1 : 0; }

  void FindEnd(std::size_t i) {
    edges_[i].end = EnvelopeVertex(sites_[edges_[Before(i)].site], sites_[edges_[i].site],
                                   sites_[edges_[After(i)].site]);
  }

  // Returns true if no other site is lower at the vertex. Otherwise a site has its part wholly
  // inside.
  bool Passes(const Vertex& vertex) const {
    return std::isfinite(vertex.level) && std::ranges::all_of(sites_, [&](const PowerSite& site) {
             return site.At(vertex.at) >= vertex.level - 1e-9 * site.distance2;
           });
  }

  // Adds the border, up to `to`, between the parts of edge i and of its predecessor.
  void AddBorder(std::size_t i, const Vec2& to) {
    const double twice = Cross(edges_[i].start, to);
    twice_area_[edges_[Before(i)].site] += twice;
    twice_area_[edges_[i].site] -= twice;
  }

  void Close(std::size_t i) {
    const Vec2 at = edges_[i].end.at;
    AddBorder(i, at);
    AddBorder(After(i), at);
    edges_[After(i)].start = at;
    edges_.erase(edges_.begin() + static_cast<std::ptrdiff_t>(i));
    const std::size_t after = i < edges_.size() ? i : 0;
    FindEnd(Before(after));
    FindEnd(after);
  }

  std::span<const PowerSite> sites_;
  SiteAreas& twice_area_;
  ActiveEdges edges_;
};

}  // namespace

PowerCell::PowerCell(double reach) {
  polygons_[0] = {{{-reach, -reach}}, {{reach, -reach}}, {{reach, reach}}, {{-reach, reach}}};
  furthest2_ = Furthest2(polygons_[0]);
}

void PowerCell::Cut(const PowerSite& site, int edge) {
  const double edge4 = site.distance2 * site.distance2;  // 4 |position|^2 times the squared
                                                         // distance of the site's edge
  if (edge4 > 4 * site.position.squaredNorm() * furthest2_) {
    return;  // beyond all corners
  }
  const int other = 1 - current_;
  const auto value = [&site](const Vec2& x) { return site.At(x); };
  if (Clip(polygons_[current_], value, edge, polygons_[other])) {
    current_ = other;
    furthest2_ = Furthest2(polygons_[current_]);
  }
}

bool SibsonAreasByEnvelope(std::span<const PowerSite> sites, const CellPolygon& cell,
                           SiteAreas& twice_area) {
  twice_area.assign(sites.size(), 0);
  return LowerEnvelopeTree(sites, cell, twice_area).Trace();
}

void SibsonAreasByClipping(std::span<const PowerSite> sites, const CellPolygon& cell,
                           SiteAreas& twice_area) {
  twice_area.assign(sites.size(), 0);
  const auto contenders = FindContenders(sites, cell);
  CellPolygon part, spare;
  for (const int own : contenders) {
    part = cell;
    for (const int other : contenders) {
      if (other != own && !part.empty()) {
        const PowerSite &a = sites[own], &b = sites[other];
        const auto value = [&](const Vec2& x) { return b.At(x) - a.At(x); };
        if (Clip(part, value, other, spare)) {
          std::swap(part, spare);
        }
      }
    }
    twice_area[own] = TwiceArea(part);
  }
}

void SibsonAreas(std::span<const PowerSite> sites, const CellPolygon& cell, SiteAreas& twice_area) {
  if (!SibsonAreasByEnvelope(sites, cell, twice_area)) {
    SibsonAreasByClipping(sites, cell, twice_area);
  }
}

}  // namespace semblance::interp
