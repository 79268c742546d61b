// SPDX-License-Identifier: GPL-3.0-or-later
// Options of an experiment for single sites: additional dowels (thesis 4.2: inserted dowels), and
// the place of a site on the generic face.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "problems/config/config_tree.h"
#include "problems/subject/average_skull.h"
#include "surfaces/base/fields.h"

namespace semblance::problems {

struct ExtraSite {
  std::optional<std::array<double, 2>> uv;
  ConfigNode near;  // see ReadPlace; null: not given
  std::optional<AutoOr<double>> depth;
  std::optional<std::array<double, 3>> direction;
  bool hold = false;
};

// Sites by name, sorted by name.
using ExtraSites = std::map<std::string, ExtraSite>;

template <class Visitor>
void Fields(Visitor& visit, ExtraSite& o) {
  visit(FieldInfo{.name = "uv",
                  .min = 0,
                  .max = 1,
                  .doc = "(u,v) of the site on the generic face; a site that is not a landmark is "
                         "also placed by it, on the bone under that point"},
        o.uv);
  visit(FieldInfo{.name = "near",
                  .doc = "place of a site that is not a landmark: the point of the bone nearest to "
                         "[x, y, z] in mm (LPS), to a landmark such as go_l, or to the middle of "
                         "several, as [n, rhi]"},
        o.near);
  visit(FieldInfo{.name = "depth",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "tissue depth; auto: the interpolated depth (a dowel for the fit only); "
                         "without it a table's depth at the site"},
        o.depth);
  visit(FieldInfo{.name = "direction",
                  .doc = "direction of an inserted dowel, out of the bone, of any length, in LPS; "
                         "without it the bone's mean normal; at most 75 degrees from it"},
        o.direction);
  visit(FieldInfo{.name = "hold", .doc = "true: relaxation does not move the site's (u,v)"},
        o.hold);
}

// The meaning of `near`: a point, or one or more landmarks, or a fault.
struct SitePlace {
  std::optional<Vec3> point;           // mm, LPS
  std::vector<std::string> landmarks;  // at least one if there is no point and no fault
  std::string fault;
};
SitePlace ReadPlace(const ConfigNode& near);

template <class Report>
void CheckValue(Report& report, const ExtraSite& site) {
  if (site.uv && !site.near.IsNull()) {
    report("near", "the place of the site is given twice, as `uv` and as `near`; give one of them");
  }
  if (site.direction && !(Vec3(site.direction->data()).norm() > 0)) {
    report("direction", "has no length; write [x, y, z] out of the bone, or leave it out");
  }
  if (!site.near.IsNull()) {
    if (const std::string fault = ReadPlace(site.near).fault; !fault.empty()) {
      report("near", fault);
    }
  }
}

// Faults that the names alone reveal, for any subject; a path is "name" or "name.field". A name
// that is no site of sites.h needs a place; without one it is a misspelt site.
std::vector<OptionFault> SiteOptionFaults(const ExtraSites& sites);

// True if the option `hold` is set for the site.
bool IsHeld(const ExtraSites& sites, const std::string& site);

// The point of a site before it is laid onto bone: the point of `near`, or the middle of its
// landmarks. A standard landmark that is not given is predicted. Throws InputError, naming `site`,
// if a landmark of `near` is neither given nor standard.
Vec3 PointNear(const std::string& site, const ConfigNode& near, std::span<const SitePoint> given);

}  // namespace semblance::problems
