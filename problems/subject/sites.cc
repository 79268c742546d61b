// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "problems/config/spelling_suggestion.h"

namespace semblance::problems {
namespace {

struct StandardLandmark {
  int number;
  const char* code;
  const char* name;
  bool paired;
};

constexpr StandardLandmark kSiteRows[] = {
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

// Names of the points on bone. Caple & Stephan (2016) define them.
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

bool Contains(const std::vector<Site>& list, std::string_view site) {
  return std::ranges::find(list, site, &Site::code) != list.end();
}

std::string UnknownSite(std::string_view site, const std::vector<std::string>& codes) {
  const Site* const pair = FindLandmark(site);
  return pair != nullptr && std::ranges::find(codes, pair->code) != codes.end()
             ? fmt::format("site '{0}' is on both sides; write '{0}_l' or '{0}_r'", site)
             : fmt::format("unknown site '{}'{}", site, Suggestion(site, codes));
}

struct OtherName {
  std::string_view name;  // in lower case, words separated by blanks
  std::string_view landmark;
};

// Names besides the codes and the names as printed in the thesis. Names of points that lie
// elsewhere on the bone (orbitale, subnasale, infradentale of the teeth) are left out on purpose.
constexpr OtherName kOtherNames[] = {
    {"rhinion", "rhi"},       {"end of nasal", "rhi"},     {"prosthion", "pr"},
    {"upper lip", "pr"},      {"infradentale", "id"},      {"lower lip", "id"},
    {"supramentale", "sm"},   {"chin lip", "sm"},          {"pogonion", "pg"},
    {"menton", "me"},         {"midphiltrum", "mp"},       {"mid supraorbital", "mso"},
    {"supraorbitale", "mso"}, {"mid infraorbital", "mio"}, {"infraorbital", "mio"},
    {"zygion", "zy"},         {"zygomatic arch", "zy"},    {"supra m 2", "sM2"},
    {"sub m 2", "iM2"},       {"infra m2", "iM2"},         {"mid ramus", "mr"},
};

// Splits a name into words of letters and digits, in lower case.
std::vector<std::string> SplitWords(std::string_view name) {
  std::vector<std::string> words(1);
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) {
      words.back() += static_cast<char>(std::tolower(byte));
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) {
    words.pop_back();
  }
  return words;
}

std::optional<Side> ParseSide(std::string_view word) {
  if (word == "l" || word == "left") {
    return Side::kLeft;
  }
  if (word == "r" || word == "right") {
    return Side::kRight;
  }
  return std::nullopt;
}

// Removes the side from the words: at the beginning, at the end, or after a number ("18r").
Side RemoveSide(std::vector<std::string>& words) {
  if (words.size() > 1) {
    if (const auto side = ParseSide(words.back())) {
      words.pop_back();
      return *side;
    }
    if (const auto side = ParseSide(words.front())) {
      words.erase(words.begin());
      return *side;
    }
  }
  std::string& last = words.back();
  const auto side = ParseSide(std::string_view(last).substr(last.size() - 1));
  const bool after_number =
      last.size() > 1 && std::all_of(last.begin(), last.end() - 1, [](char c) {
        return std::isdigit(static_cast<unsigned char>(c)) != 0;
      });
  if (side && after_number) {
    last.pop_back();
    return *side;
  }
  return Side::kMidline;
}

std::string Joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

bool IsNamed(const Site& site, const std::string& name) {
  if (name == Joined(SplitWords(site.landmark)) || name == Joined(SplitWords(site.name)) ||
      (site.number > 0 && name == std::to_string(site.number))) {
    return true;
  }
  return std::any_of(std::begin(kOtherNames), std::end(kOtherNames), [&](const OtherName& other) {
    return other.landmark == site.landmark && other.name == name;
  });
}

NamedSite UnknownName(std::string_view name) {
  std::vector<std::string> known;
  for (const Site& site : AllSites()) {
    known.push_back(site.code);
    known.emplace_back(site.name);
  }
  const std::string near = NearestWord(name, known);
  return {
      .code = "",
      .fault = fmt::format("'{}' is not a site{}; use a code such as g or go_l, a number of the "
                           "thesis (1 to 21, with l or r) or a name such as 'left gonion'",
                           name, near.empty() ? "" : fmt::format("; did you mean '{}'?", near))};
}

}  // namespace

const std::vector<Site>& StandardSites() {
  static const std::vector<Site> sites = MakeSites(kSiteRows);
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

std::string MirroredSite(std::string_view code) {
  const Site* const site = FindSite(code);
  return site == nullptr ? "" : site->mirror;
}

bool IsStandardSite(std::string_view site) { return Contains(StandardSites(), site); }
bool IsFurtherSite(std::string_view site) { return Contains(FurtherSites(), site); }
bool IsSite(std::string_view name) { return FindSite(name) != nullptr; }

std::vector<std::string> StandardSiteCodes() {
  std::vector<std::string> codes;
  std::ranges::transform(StandardSites(), std::back_inserter(codes), &Site::code);
  return codes;
}

std::string DescribeSite(std::string_view site) {
  const Site* const known = FindLandmark(WithoutSide(site));
  return known == nullptr ? std::string(site) : fmt::format("{} ({})", site, known->name);
}

std::string StandardSiteFault(std::string_view site) {
  return IsStandardSite(site) ? "" : UnknownSite(site, StandardSiteCodes());
}

std::string SiteFault(std::string_view site) {
  if (IsSite(site)) {
    return "";
  }
  std::vector<std::string> codes = StandardSiteCodes();
  std::ranges::transform(FurtherSites(), std::back_inserter(codes), &Site::code);
  return UnknownSite(site, codes);
}

NamedSite FindSiteByName(std::string_view name) {
  std::vector<std::string> words = SplitWords(name);
  if (words.empty()) {
    return UnknownName(name);
  }
  const Side side = RemoveSide(words);
  const std::string landmark = Joined(words);
  std::optional<Site> named;
  for (const Site& site : AllSites()) {
    if (IsNamed(site, landmark)) {
      named = site;
      if (site.side == side) {
        return {.code = site.code, .fault = ""};
      }
    }
  }
  if (!named) {
    return UnknownName(name);
  }
  return {
      .code = "",
      .fault = side == Side::kMidline
                   ? fmt::format("'{0}' is on both sides; state the side, as '{1}_l' or '{1}_r'",
                                 name, named->landmark)
                   : fmt::format("'{}' has a side, and {} lies in the midline; write '{}'", name,
                                 DescribeSite(named->code), named->code)};
}

std::vector<std::string> OtherSiteNames(std::string_view landmark) {
  std::vector<std::string> names;
  for (const OtherName& other : kOtherNames) {
    if (other.landmark == landmark) {
      names.emplace_back(other.name);
    }
  }
  return names;
}

}  // namespace semblance::problems
