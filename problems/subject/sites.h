// SPDX-License-Identifier: GPL-3.0-or-later
// The sites of the skull: the standard ones (thesis app. A), and those that other tables have
// beside them. What a phantom or a generic face has there stands with these, keyed by the codes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel.h"

namespace semblance {

struct Site {
  std::string code;       // with side, e.g. "g", "go_l"
  std::string landmark;   // the code without side, "go": what tables of depth name
  int number;             // of the landmark in the thesis's tables, 1 ... 21; 0: not there
  std::string_view name;  // of the landmark as printed there, e.g. "Gonion"
  Side side;
  std::string mirror;  // the code of the site on the other side; its own in the midline
};

// All 32 in the order of the thesis's tables: 10 in the midline, then 11 pairs, left before right.
const std::vector<Site>& StandardSites();

// Their codes in that order.
std::vector<std::string> StandardSiteCodes();

// The 13 of published tables that the network lacks, e.g. "mmb_l" (Caple & Stephan 2016): 5 in the
// midline, then 4 pairs. A landmark may stand at one, and its table gives the depth; the generic
// face and the average skull have none.
const std::vector<Site>& FurtherSites();

// The standard ones, then the further ones.
const std::vector<Site>& AllSites();

// Of all; null for a code that is none of theirs.
const Site* FindSite(std::string_view code);

// The code of the site on the other side, of all sites; "" for a code that is none of theirs.
std::string MirrorOf(std::string_view code);

bool IsStandardSite(std::string_view site);
bool IsFurtherSite(std::string_view site);

// "go_l (Gonion)", also of "go"; the code alone where the site is in neither list.
std::string SiteInWords(std::string_view site);

// "" if `site` is one of StandardSiteCodes(), else what is wrong with it and what to do.
std::string ComplaintAboutSite(std::string_view site);

// The same where a further site may stand too: in landmarks' files and depths by site.
std::string ComplaintAboutLandmark(std::string_view site);

}  // namespace semblance
