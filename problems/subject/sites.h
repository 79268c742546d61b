// SPDX-License-Identifier: GPL-3.0-or-later
// The sites of the skull: the standard sites (thesis app. A) and the further sites of other tables.
// People may name a site by its code, its number in the thesis or a plain name.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/dowel.h"

namespace semblance::problems {

struct Site {
  std::string code;       // with side, e.g. "g", "go_l"
  std::string landmark;   // the code without side, "go", by which depth tables name it
  int number;             // of the landmark in the thesis's tables, 1 ... 21; 0: none
  std::string_view name;  // name of the landmark as printed there, e.g. "Gonion"
  Side side;
  std::string mirror;  // code of the site on the other side; in the midline its own code
};

// All 32 standard sites in the order of the thesis's tables: 10 in the midline, then 11 pairs, left
// before right.
const std::vector<Site>& StandardSites();

// The codes of the standard sites in that order.
std::vector<std::string> StandardSiteCodes();

// The 21 sites that the standard network lacks: 13 of published tables, e.g. "mmb_l" (Caple &
// Stephan 2016), 5 in the midline and 4 pairs, then 4 pairs at the side of the head, where no table
// has a site (configs/people/build.py states their places). A landmark may be placed at one of
// them; a table with the site states its depth. The generic face and the average skull do not have
// these sites.
const std::vector<Site>& FurtherSites();

// The standard sites, then the further sites.
const std::vector<Site>& AllSites();

// Finds the site among all sites; null if no site has the code.
const Site* FindSite(std::string_view code);

// The code of the site on the other side; empty if no site has the code.
std::string MirroredSite(std::string_view code);

bool IsStandardSite(std::string_view site);
bool IsFurtherSite(std::string_view site);
bool IsSite(std::string_view name);  // standard or further

// "go_l (Gonion)"; a code without side also works. The code alone if the site is in neither list.
std::string DescribeSite(std::string_view site);

// Names of the parts of the face. FacePartOfSite returns the part of a standard site, as an index
// of this list. It throws InputError for another site.
inline constexpr std::array<const char*, 8> kFaceParts = {"forehead", "orbits", "nose", "cheeks",
                                                          "mouth",    "chin",   "jaw",  "temples"};
int FacePartOfSite(const std::string& site);

// A part of the face as an option, in the order of kFaceParts.
enum class FacePart { kForehead, kOrbits, kNose, kCheeks, kMouth, kChin, kJaw, kTemples };
constexpr auto EnumNames(FacePart) {
  std::array<std::string_view, kFaceParts.size()> names;
  std::ranges::copy(kFaceParts, names.begin());
  return names;
}

// Empty if `site` is a standard site; otherwise the fault and the remedy.
std::string StandardSiteFault(std::string_view site);

// The same where a further site is allowed too: in landmark files and depths by site.
std::string SiteFault(std::string_view site);

// The site that a name means.
struct NamedSite {
  std::string code;   // standard or further; empty if the name is not understood
  std::string fault;  // the fault and the remedy in that case; otherwise empty
  std::string note;   // for people, if the name could also mean another site; mostly empty
};

// Finds the standard or further site that a name means. Upper and lower case, blanks, dashes, '_',
// '.', ',', ':', ';', '/', brackets and quotes around the name make no difference; any other sign
// makes a name unknown. The landmark is a code ("go"), its number in the thesis (18) or a name
// ("gonion", "end of nasals", "rhinion"). The side is l, r, left or right, before or after the
// landmark ("left gonion", "Gonion (L)", "go_L", "18r"), or directly after a code ("goL", as Caple
// and Stephan 2016 write). A landmark in the midline takes no side; a landmark of a pair needs one.
// A name with a prime ("n'") or with a word such as "soft" or "skin" means a point on the skin, and
// so no site on the bone; for points that lie on the skin, primes and these words are dropped.
enum class PointsLieOn { kBone, kSkin };
NamedSite FindSiteByName(std::string_view name, PointsLieOn place = PointsLieOn::kBone);

// Further names of a landmark ("go"), besides its code, number and printed name.
std::vector<std::string> OtherSiteNames(std::string_view landmark);

}  // namespace semblance::problems
