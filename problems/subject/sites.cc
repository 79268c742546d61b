// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>

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

// Names of the points on bone; definitions: Caple & Stephan 2016.
constexpr StandardLandmark kFurther[] = {
    {0, "op", "Opisthocranion", false},
    {0, "v", "Vertex", false},
    {0, "mn", "Mid-nasal", false},
    {0, "ss", "Subspinale", false},
    {0, "gn", "Gnathion", false},
    {0, "ac", "Alare curvature point", true},
    {0, "sC", "Supra canine", true},
    {0, "iC", "Infra canine", true},
    {0, "mmb", "Mid-mandibular border", true},
};

std::vector<Site> MakeSites(std::span<const StandardLandmark> landmarks) {
  std::vector<Site> sites;
  for (const auto& [number, code, name, paired] : landmarks) {
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
  const auto at = std::ranges::find(AllSites(), landmark, &Site::landmark);
  return at == AllSites().end() ? nullptr : &*at;
}

bool Stands(const std::vector<Site>& list, std::string_view site) {
  return std::ranges::find(list, site, &Site::code) != list.end();
}

std::string UnknownSite(std::string_view site, const std::vector<std::string>& codes) {
  const Site* const pair = FindLandmark(site);
  return pair != nullptr && std::ranges::find(codes, pair->code) != codes.end()
             ? fmt::format("site '{0}' stands on both sides; write '{0}_l' or '{0}_r'", site)
             : fmt::format("unknown site '{}'{}", site, Suggestion(site, codes));
}

}  // namespace

const std::vector<Site>& StandardSites() {
  static const std::vector<Site> sites = MakeSites(kLandmarks);
  return sites;
}

const std::vector<Site>& FurtherSites() {
  static const std::vector<Site> sites = MakeSites(kFurther);
  return sites;
}

const std::vector<Site>& AllSites() {
  static const std::vector<Site> sites = [] {
    std::vector<Site> all = StandardSites();
    all.insert(all.end(), FurtherSites().begin(), FurtherSites().end());
    return all;
  }();
  return sites;
}

const Site* FindSite(std::string_view code) {
  const auto at = std::ranges::find(AllSites(), code, &Site::code);
  return at == AllSites().end() ? nullptr : &*at;
}

std::string MirrorOf(std::string_view code) {
  const Site* const site = FindSite(code);
  return site == nullptr ? "" : site->mirror;
}

bool IsStandardSite(std::string_view site) { return Stands(StandardSites(), site); }
bool IsFurtherSite(std::string_view site) { return Stands(FurtherSites(), site); }

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
  return IsStandardSite(site) ? "" : UnknownSite(site, StandardSiteCodes());
}

std::string ComplaintAboutLandmark(std::string_view site) {
  if (IsStandardSite(site) || IsFurtherSite(site)) {
    return "";
  }
  std::vector<std::string> codes = StandardSiteCodes();
  std::ranges::transform(FurtherSites(), std::back_inserter(codes), &Site::code);
  return UnknownSite(site, codes);
}

}  // namespace semblance
