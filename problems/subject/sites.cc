// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/config/spelling_suggestion.h"

namespace semblance {
namespace {

struct StandardLandmark {
  int number;
  const char* code;
  const char* name;
  bool paired;
};

constexpr StandardLandmark kLandmarks[] = {
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
};

std::vector<Site> MakeSites() {
  std::vector<Site> sites;
  for (const auto& [number, code, name, paired] : kLandmarks) {
    if (!paired) {
      sites.push_back({code, code, number, name, Side::kMidline, code});
      continue;
    }
    const std::string left = fmt::format("{}_l", code), right = fmt::format("{}_r", code);
    sites.push_back({left, code, number, name, Side::kLeft, right});
    sites.push_back({right, code, number, name, Side::kRight, left});
  }
  return sites;
}

const Site* FindLandmark(std::string_view landmark) {
  const auto it = std::ranges::find(StandardSites(), landmark, &Site::landmark);
  return it == StandardSites().end() ? nullptr : &*it;
}

}  // namespace

const std::vector<Site>& StandardSites() {
  static const std::vector<Site> sites = MakeSites();
  return sites;
}

std::vector<std::string> StandardSiteCodes() {
  std::vector<std::string> codes;
  std::ranges::transform(StandardSites(), std::back_inserter(codes), &Site::code);
  return codes;
}

std::string SiteInWords(std::string_view site) {
  const Site* const known = FindLandmark(WithoutSide(site));
  return known == nullptr ? std::string(site) : fmt::format("{} ({})", site, known->name);
}

std::string ComplaintAboutSite(std::string_view site) {
  const std::vector<std::string> codes = StandardSiteCodes();
  if (std::ranges::find(codes, site) != codes.end()) {
    return "";
  }
  if (FindLandmark(site) != nullptr) {
    return fmt::format("site '{0}' stands on both sides; write '{0}_l' or '{0}_r'", site);
  }
  return fmt::format("unknown site '{}'{}", site, Suggestion(site, codes));
}

}  // namespace semblance
