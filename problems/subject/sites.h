// SPDX-License-Identifier: GPL-3.0-or-later
// The standard sites of the skull (thesis app. A): their codes and the names printed there.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace semblance {

struct StandardSite {
  int number;             // in the thesis's tables, 1 ... 21
  std::string_view code;  // without side
  std::string_view name;  // as printed, e.g. "Gonion"
  bool paired;            // once on each side: code + "_l" and code + "_r"
};

// In the order of the tables: 10 in the midline, 11 in pairs.
const std::array<StandardSite, 21>& StandardSites();

// The codes of the 32 sites, those of pairs with side, in the order of the tables, left first.
std::vector<std::string> StandardSiteCodes();

// "go" of "go_l", "go_r" and "go".
std::string WithoutSide(std::string_view site);

// "go_l (Gonion)"; the code alone where the site is not a standard one.
std::string SiteInWords(std::string_view site);

// "" if `site` is one of StandardSiteCodes(), else what is wrong with it and what to do.
std::string ComplaintAboutSite(std::string_view site);

}  // namespace semblance
