// SPDX-License-Identifier: GPL-3.0-or-later
// The standard sites of the skull (thesis app. A): who they are. What a phantom or a generic face
// has there stands with these, keyed by the codes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/site_code.h"

namespace semblance {

struct Site {
  std::string code;       // with side, e.g. "g", "go_l"
  std::string landmark;   // the code without side, "go": what tables of depth name
  int number;             // of the landmark in the thesis's tables, 1 ... 21
  std::string_view name;  // of the landmark as printed there, e.g. "Gonion"
  Side side;
  std::string mirror;  // the code of the site on the other side; its own in the midline
};

// All 32 in the order of the thesis's tables: 10 in the midline, then 11 pairs, left before right.
const std::vector<Site>& StandardSites();

// Their codes in that order.
std::vector<std::string> StandardSiteCodes();

// "go_l (Gonion)", also of "go"; the code alone where the site is not a standard one.
std::string SiteInWords(std::string_view site);

// "" if `site` is one of StandardSiteCodes(), else what is wrong with it and what to do.
std::string ComplaintAboutSite(std::string_view site);

}  // namespace semblance
