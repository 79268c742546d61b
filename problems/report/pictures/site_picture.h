// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures of the sites on the mean skull of people (mean_skull.h).
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>

#include "problems/report/pictures/image.h"
#include "problems/report/pictures/render.h"

namespace semblance::problems {

// The skull from the front and from its left as an SVG file that embeds the rendered pictures, with
// the standard sites as dots and their numbers as text.
std::string SitePictureSvg(int threads);

// A skull and its sites, kept to draw a picture for each site. The mean skull has no further sites;
// they are placed between other sites, as their definitions state; vertex and opisthocranion where
// a whole brain case would have them.
struct SiteSketch {
  struct Seen {
    Camera camera;
    Image bone;
    std::map<std::string, bool> hides;  // by site: true if bone hides it
  };
  std::map<std::string, Vec3> places;  // of all standard and further sites, mm
  std::array<Seen, 3> seen;            // from the front, from the left, from the right
};
SiteSketch MakeSiteSketch(int threads);

// The site seen from the front and from its side (a site in the midline: from the left), 440 x 260
// pixels. The site is a large disc, or a ring if bone hides it; the standard sites of that side are
// small discs. Throws InputError for a site that is in neither list.
Image DrawSitePicture(const SiteSketch& sketch, std::string_view site);

}  // namespace semblance::problems
