// SPDX-License-Identifier: GPL-3.0-or-later
// What an experiment says of single sites: dowels of its own beside the landmarks' (thesis 4.2:
// inserted dowels), and where a site lies on the generic face.
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

namespace semblance {

struct ExtraSite {
  std::optional<std::array<double, 2>> uv;  // on the generic face; none: as it has it
  ConfigNode near;                          // as ReadPlace takes it; null: not given
  std::optional<AutoOr<double>> depth;      // mm; auto: as interpolated; none: a table's
  bool hold = false;                        // of the site's (u,v)
};

// By name, in the order of their names.
using ExtraSites = std::map<std::string, ExtraSite>;

template <class Visitor>
void Fields(Visitor& visit, ExtraSite& o) {
  visit(FieldInfo{.name = "uv",
                  .min = 0,
                  .max = 1,
                  .doc = "where the site lies on the generic face, in its (u,v); of a site that is "
                         "not a landmark also where it stands: the bone under that point"},
        o.uv);
  visit(
      FieldInfo{.name = "near",
                .doc = "where a site that is not a landmark stands: the point of the bone nearest "
                       "to [x, y, z] in mm (LPS), to a landmark such as go_l, or to the middle "
                       "of several, as [n, rhi]"},
      o.near);
  visit(FieldInfo{.name = "depth",
                  .unit = "mm",
                  .min = 0.01,
                  .max = 100,
                  .doc = "of the tissue; auto: as it is interpolated there (a dowel for the fit "
                         "alone); else a table's that has the site"},
        o.depth);
  visit(FieldInfo{.name = "hold", .doc = "relaxation does not move the site's (u,v)"}, o.hold);
}

// The meaning of `near`.
struct SitePlace {
  std::optional<Vec3> point;           // mm, LPS
  std::vector<std::string> landmarks;  // without a point: one at least
  std::string fault;                   // what is wrong where there is neither
};
SitePlace ReadPlace(const ConfigNode& near);

template <class Report>
void CheckValue(Report& report, const ExtraSite& site) {
  if (site.uv && !site.near.IsNull()) {
    report("near", "where the site is appears twice, as `uv` and as `near`; give one of them");
  }
  if (!site.near.IsNull()) {
    if (const std::string fault = ReadPlace(site.near).fault; !fault.empty()) {
      report("near", fault);
    }
  }
}

// Faults that the names alone tell, whoever the subject is; a path is "name" or "name.field". A
// name that is no site of sites.h needs a place: else it is one misspelt.
std::vector<OptionFault> FaultsOfSites(const ExtraSites& sites);

bool IsHeld(const ExtraSites& sites, const std::string& site);

// Where a site stands, before it is laid onto bone: the point, or the middle of the landmarks,
// where they are given or else predicted. Throws InputError, naming `site`, if a landmark of `near`
// is neither given nor standard.
Vec3 PointNear(const std::string& site, const ConfigNode& near, std::span<const SitePoint> given);

}  // namespace semblance
