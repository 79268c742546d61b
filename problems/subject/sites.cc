// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/sites.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "problems/config/spelling_suggestion.h"
#include "problems/config/utf8_check.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

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
    {0, "ut", "Upper temple", true},
    {0, "tf", "Temporal fossa", true},
    {0, "ma", "Upper masseter", true},
    {0, "pa", "Parotid region", true},
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
    {"ecm2", "sM2"},          {"ecm2 superior", "sM2"},    {"ecm2 inferior", "iM2"},
};

// The words of a name, and whether it can name a site on bone.
struct NameWords {
  std::vector<std::string> words;  // of letters and digits, in lower case
  bool has_prime = false;          // after a word, as in n'
  bool has_other_sign = false;     // one that is neither a letter, a digit, a blank nor a separator
  bool is_lower_index = false;     // has a 2 below the line, as in ecm with the lower jaw's index
};

bool IsOneOf(char32_t code, std::u32string_view list) { return list.find(code) != list.npos; }

// Blanks, dashes and other signs between words.
bool IsSeparator(char32_t code) {
  return IsOneOf(code, U" \t_-.(),:;/[]{}\u00A0\u202F\u2212\u3000") ||
         (code >= 0x2000 && code <= 0x2015);
}

// Signs that mark a point on the skin, typographic and typed.
bool IsPrime(char32_t code) {
  return IsOneOf(code,
                 U"'`\"\u00B4\u02B9\u02BA\u02BC\u02CA\u2018\u2019\u201D\u2032\u2033\u2034\uFF07");
}

// Takes away quotes around a whole name.
std::string_view Unquoted(std::string_view name) {
  const bool is_quoted = name.size() > 2 && (name.front() == '\'' || name.front() == '"') &&
                         name.back() == name.front();
  return is_quoted ? name.substr(1, name.size() - 2) : name;
}

NameWords SplitName(std::string_view name) {
  NameWords split;
  split.words.emplace_back();
  const std::string normal = Normalized(Unquoted(name));
  for (const Character& c : SplitCharacters(normal)) {
    constexpr char32_t kUpperTwo = 0xB2, kLowerTwo = 0x2082;
    const bool is_two = c.code == kUpperTwo || c.code == kLowerTwo;
    std::string& word = split.words.back();
    if (is_two || (c.code < 0x80 && std::isalnum(static_cast<int>(c.code)) != 0)) {
      word += is_two ? '2' : static_cast<char>(std::tolower(static_cast<int>(c.code)));
      split.is_lower_index |= c.code == kLowerTwo;
    } else if (IsPrime(c.code)) {
      split.has_prime |= split.words.size() > 1 || !word.empty();
    } else if (!IsSeparator(c.code)) {
      split.has_other_sign = true;
    } else if (!word.empty()) {
      split.words.emplace_back();
    }
  }
  if (split.words.back().empty()) {
    split.words.pop_back();
  }
  return split;
}

std::vector<std::string> SplitWords(std::string_view name) { return SplitName(name).words; }

bool IsSkinWord(const std::string& word) {
  constexpr std::array<std::string_view, 6> kSkinWords = {"soft",      "tissue", "skin",
                                                          "cutaneous", "dermal", "epidermal"};
  return std::ranges::find(kSkinWords, word) != kSkinWords.end();
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

bool IsCodeOfPair(const std::string& word) {
  return std::ranges::any_of(AllSites(), [&](const Site& site) {
    return site.side != Side::kMidline && word == LowerCase(site.landmark);
  });
}

// Splits "gol" into "go" and "l", if no landmark has the whole as its code.
void DetachSide(std::vector<std::string>& words) {
  const std::string& word = words.back();
  const bool is_code = std::ranges::any_of(
      AllSites(), [&](const Site& site) { return word == LowerCase(site.landmark); });
  if (words.size() != 1 || is_code || word.size() < 2 ||
      (word.back() != 'l' && word.back() != 'r')) {
    return;
  }
  const std::string code = word.substr(0, word.size() - 1), side = word.substr(word.size() - 1);
  if (code == "ecm2" || IsCodeOfPair(code)) {
    words = {code, side};
  }
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
                           name, near.empty() ? "" : fmt::format("; did you mean '{}'?", near)),
      .note = ""};
}

// ecm2 is the bone's point of the second molar in either jaw, if no index above or below the line
// distinguishes them.
std::string NoteOnName(std::string_view name, const std::string& landmark,
                       const std::string& code) {
  const bool has_index = name.find("\u00B2") != name.npos;
  return landmark != "ecm2" || has_index
             ? ""
             : fmt::format("'{}' is taken for {}; name the point of the lower jaw iM2", name,
                           DescribeSite(code));
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

int FacePartOfSite(const std::string& site) {
  static const std::map<std::string, int> kPartOf = {
      {"sg", 0}, {"g", 0},  {"fe", 0}, {"mso", 1}, {"mio", 1}, {"n", 2},   {"rhi", 2},
      {"im", 3}, {"lo", 3}, {"zy", 3}, {"sM2", 3}, {"mp", 4},  {"pr", 4},  {"id", 4},
      {"sm", 5}, {"pg", 5}, {"me", 5}, {"go", 6},  {"mr", 6},  {"iM2", 6}, {"sgl", 7}};
  const auto found = kPartOf.find(WithoutSide(site));
  if (found == kPartOf.end()) {
    throw InputError(fmt::format(
        "face region: site '{}' belongs to no part of the face; known are the 21 standard sites",
        site));
  }
  return found->second;
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

NamedSite FindSiteByName(std::string_view name, PointsLieOn place) {
  NameWords split = SplitName(name);
  std::vector<std::string>& words = split.words;
  const bool is_on_skin = std::erase_if(words, IsSkinWord) > 0 || split.has_prime;
  if (is_on_skin && place == PointsLieOn::kBone) {
    return {.code = "",
            .fault = fmt::format("'{}' names a point on the skin, and landmarks are points on the "
                                 "bone; place the bone's point, or leave this one out",
                                 name),
            .note = ""};
  }
  if (words.empty() || split.has_other_sign) {
    return UnknownName(name);
  }
  DetachSide(words);
  const Side side = RemoveSide(words);
  const std::string landmark =
      split.is_lower_index && words == std::vector<std::string>{"ecm2"} ? "im2" : Joined(words);
  std::optional<Site> named;
  for (const Site& site : AllSites()) {
    if (IsNamed(site, landmark)) {
      named = site;
      if (site.side == side) {
        return {.code = site.code, .fault = "", .note = NoteOnName(name, landmark, site.code)};
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
                                 DescribeSite(named->code), named->code),
      .note = ""};
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
