// SPDX-License-Identifier: GPL-3.0-or-later
// The cell of a point among sites in the plane, and the area that each site would lose to it.
#pragma once

#include <array>
#include <boost/container/small_vector.hpp>
#include <span>

#include "surfaces/base/geometry.h"

namespace semblance::interp {

// A site in a plane with the point as origin. The site's power at x minus the point's power is the
// linear function distance2 - 2 position . x, which is negative where the site keeps x.
struct PowerSite {
  Vec2 position;
  double distance2 = 0;  // squared distance to the point in space, >= position^2

  double At(const Vec2& x) const { return distance2 - 2 * position.dot(x); }
};

// A corner of a convex polygon, counter-clockwise. `edge` is the site behind the edge from this
// corner to the next, or kOpenEdge.
constexpr int kOpenEdge = -1;
struct CellCorner {
  Vec2 at;
  int edge = kOpenEdge;
};
// Small polygons live on the stack, because a field needs hundreds of thousands.
using CellPolygon = boost::container::small_vector<CellCorner, 24>;
using SiteAreas = boost::container::small_vector<double, 48>;

// The polygon in |x|, |y| <= reach where the functions of all sites are >= 0. Sites cut it one
// after another; near sites first is fastest. Open edges lie on the square.
class PowerCell {
 public:
  explicit PowerCell(double reach);

  // edge: the site's number.
  void Cut(const PowerSite& site, int edge);
  const CellPolygon& polygon() const { return polygons_[current_]; }
  // Squared distance of the furthest corner from the point; 0 for an empty cell.
  double FurthestCorner2() const { return furthest2_; }

 private:
  std::array<CellPolygon, 2> polygons_;  // the cell, and space for the next one
  int current_ = 0;
  double furthest2_ = 0;
};

// Computes twice the area that each site loses to a closed cell (Sibson 1981): the area of the part
// of the cell where the site's function is the smallest. Uses the lower envelope of the functions
// or, if that fails (a site's part lies wholly inside the cell, or ties), clipping.
void SibsonAreas(std::span<const PowerSite> sites, const CellPolygon& cell, SiteAreas& twice_area);

// The two methods. The envelope method returns false if it fails. Clipping always works and costs
// the square of the number of sites with a part.
bool SibsonAreasByEnvelope(std::span<const PowerSite> sites, const CellPolygon& cell,
                           SiteAreas& twice_area);
void SibsonAreasByClipping(std::span<const PowerSite> sites, const CellPolygon& cell,
                           SiteAreas& twice_area);

}  // namespace semblance::interp
