// SPDX-License-Identifier: GPL-3.0-or-later
// The cell that a point would have among sites, and what of it each of them would lose.
#pragma once

#include <array>
#include <boost/container/small_vector.hpp>
#include <span>

#include "surfaces/base/geometry.h"

namespace semblance {

// In a plane, with the point as origin. A site's power at x less that of the point is
// distance2 - 2 position . x: a linear function, negative where the site would keep x.
struct PowerSite {
  Vec2 position;
  double distance2 = 0;  // to the point, in space; at least that in the plane

  double At(const Vec2& x) const { return distance2 - 2 * position.dot(x); }
};

// A convex polygon, counter-clockwise; `edge` is the site behind the edge from this corner to the
// next, kOpenEdge where there is none.
constexpr int kOpenEdge = -1;
struct CellCorner {
  Vec2 at;
  int edge = kOpenEdge;
};
// Small ones live on the stack: a field asks for hundreds of thousands.
using CellPolygon = boost::container::small_vector<CellCorner, 24>;
using SiteAreas = boost::container::small_vector<double, 48>;

// Where all sites' values are >= 0, within |x|, |y| <= reach, cut out by one site after another:
// soonest if near ones come first. Open edges lie on that square.
class PowerCell {
 public:
  explicit PowerCell(double reach);

  // `edge` is the site's number.
  void Cut(const PowerSite& site, int edge);
  const CellPolygon& polygon() const { return polygons_[current_]; }
  // Of its corners, from the point; 0 of an empty cell.
  double FurthestCorner2() const { return furthest2_; }

 private:
  std::array<CellPolygon, 2> polygons_;  // the cell, and room for what the next site leaves of it
  int current_ = 0;
  double furthest2_ = 0;
};

// Twice the area that each site would lose to a closed cell, one per site (Sibson 1981): that of
// the part of the cell where the site's value is the least. By the tree of the lower envelope of
// the values; where that does not do (a site whose part lies wholly inside, ties) by clipping.
void SibsonAreas(std::span<const PowerSite> sites, const CellPolygon& cell, SiteAreas& twice_area);

// The two ways. The envelope's returns false where it does not do. Clipping always does; it costs
// the square of the number of sites that have a part.
bool SibsonAreasByEnvelope(std::span<const PowerSite> sites, const CellPolygon& cell,
                           SiteAreas& twice_area);
void SibsonAreasByClipping(std::span<const PowerSite> sites, const CellPolygon& cell,
                           SiteAreas& twice_area);

}  // namespace semblance
