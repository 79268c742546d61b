// SPDX-License-Identifier: GPL-3.0-or-later
// Where the sites lie, on the skull of a phantom.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>

#include "problems/pictures/image.h"
#include "problems/pictures/render.h"

namespace semblance {

// The skull from the front and from its left as an SVG file that embeds the rendered pictures, with
// the standard sites as dots and their numbers as text.
std::string SitePictureSvg(int threads);

// A skull and its sites, kept to draw a picture for each of them. The further sites are where their
// definition puts them between others, for a phantom has none.
struct SiteSketch {
  struct Seen {
    Camera camera;
    Image bone;
    std::map<std::string, bool> hides;  // by site: the bone lies before it
  };
  std::map<std::string, Vec3> places;  // of all standard and further sites, mm
  std::array<Seen, 3> seen;            // from the front, from its left, from its right
};
SiteSketch MakeSiteSketch(int threads);

// From the front and from the site's side (of one in the midline, the left): the site as a large
// disc, a ring where the bone hides it; the standard ones of that side as small ones. 440 x 260
// pixels. Throws InputError for a site that is in neither list.
Image PictureOf(const SiteSketch& sketch, std::string_view site);

}  // namespace semblance
