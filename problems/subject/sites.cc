// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/config/spelling_suggestion.h"

namespace semblance {

const std::array<StandardSite, 21>& StandardSites() {
  static constexpr std::array<StandardSite, 21> kSites = {{
      {1, "sg", "Supraglabella", false},
      {2, "g", "Glabella", false},
      {3, "n", "Nasion", false},
      {4, "rhi", "End of Nasals", false},
      {5, "mp", "Mid Philtrum", false},
      {6, "pr", "Upper Lip Margin", false},
      {7, "id", "Lower Lip Margin", false},
      {8, "sm", "Chin-Lip Fold", false},
      {9, "pg", "Mental Eminence", false},
      {10, "me", "Beneath Chin", false},
      {11, "fe", "Frontal Eminence", true},
      {12, "mso", "Supraorbital", true},
      {13, "mio", "Suborbital", true},
      {14, "im", "Inferior Malar", true},
      {15, "lo", "Lateral Orbit", true},
      {16, "zy", "Zygomatic Arch, midway", true},
      {17, "sgl", "Supraglenoid", true},
      {18, "go", "Gonion", true},
      {19, "sM2", "Supra M2", true},
      {20, "mr", "Occlusal Line", true},
      {21, "iM2", "Sub M2", true},
  }};
  return kSites;
}

std::vector<std::string> StandardSiteCodes() {
  std::vector<std::string> codes;
  for (const StandardSite& site : StandardSites()) {
    for (const char* side : {"_l", "_r"}) {
      if (site.paired) {
        codes.push_back(fmt::format("{}{}", site.code, side));
      }
    }
    if (!site.paired) {
      codes.emplace_back(site.code);
    }
  }
  return codes;
}

std::string WithoutSide(std::string_view site) {
  const bool sided = site.size() > 2 && (site.ends_with("_l") || site.ends_with("_r"));
  return std::string(site.substr(0, site.size() - (sided ? 2 : 0)));
}

std::string SiteInWords(std::string_view site) {
  const std::string code = WithoutSide(site);
  const auto& sites = StandardSites();
  const auto it = std::find_if(sites.begin(), sites.end(),
                               [&](const StandardSite& s) { return s.code == code; });
  return it == sites.end() ? std::string(site) : fmt::format("{} ({})", site, it->name);
}

std::string ComplaintAboutSite(std::string_view site) {
  const std::vector<std::string> known = StandardSiteCodes();
  if (std::find(known.begin(), known.end(), site) != known.end()) {
    return "";
  }
  for (const StandardSite& pair : StandardSites()) {
    if (pair.paired && pair.code == site) {
      return fmt::format("site '{0}' stands on both sides; write '{0}_l' or '{0}_r'", site);
    }
  }
  return fmt::format("unknown site '{}'{}", site, Suggestion(site, known));
}

}  // namespace semblance
