// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/subject/site_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>
#include <vector>

#include "problems/config/spelling_suggestion.h"
#include "problems/subject/sites.h"

namespace semblance {
namespace {

struct OtherName {
  std::string_view name;  // in lower case, words apart
  std::string_view landmark;
};

// Beside the codes and the names as printed in the thesis. Names of points that lie elsewhere on
// the bone (orbitale, subnasale, infradentale of the teeth) are left out on purpose.
constexpr OtherName kOtherNames[] = {
    {"rhinion", "rhi"},       {"end of nasal", "rhi"},     {"prosthion", "pr"},
    {"upper lip", "pr"},      {"infradentale", "id"},      {"lower lip", "id"},
    {"supramentale", "sm"},   {"chin lip", "sm"},          {"pogonion", "pg"},
    {"menton", "me"},         {"midphiltrum", "mp"},       {"mid supraorbital", "mso"},
    {"supraorbitale", "mso"}, {"mid infraorbital", "mio"}, {"infraorbital", "mio"},
    {"zygion", "zy"},         {"zygomatic arch", "zy"},    {"supra m 2", "sM2"},
    {"sub m 2", "iM2"},       {"infra m2", "iM2"},         {"mid ramus", "mr"},
};

// Words of letters and digits, in lower case.
std::vector<std::string> WordsOf(std::string_view name) {
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

std::optional<Side> SideOf(std::string_view word) {
  if (word == "l" || word == "left") {
    return Side::kLeft;
  }
  if (word == "r" || word == "right") {
    return Side::kRight;
  }
  return std::nullopt;
}

// Takes the side off the words: at the beginning, at the end, or behind a number ("18r").
Side TakeSide(std::vector<std::string>& words) {
  if (words.size() > 1) {
    if (const auto side = SideOf(words.back())) {
      words.pop_back();
      return *side;
    }
    if (const auto side = SideOf(words.front())) {
      words.erase(words.begin());
      return *side;
    }
  }
  std::string& last = words.back();
  const auto side = SideOf(std::string_view(last).substr(last.size() - 1));
  const bool behind_number =
      last.size() > 1 && std::all_of(last.begin(), last.end() - 1, [](char c) {
        return std::isdigit(static_cast<unsigned char>(c)) != 0;
      });
  if (side && behind_number) {
    last.pop_back();
    return *side;
  }
  return Side::kMidline;
}

std::string Joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

bool IsNamed(const Site& site, const std::string& name) {
  if (name == Joined(WordsOf(site.landmark)) || name == Joined(WordsOf(site.name)) ||
      (site.number > 0 && name == std::to_string(site.number))) {
    return true;
  }
  return std::any_of(std::begin(kOtherNames), std::end(kOtherNames), [&](const OtherName& other) {
    return other.landmark == site.landmark && other.name == name;
  });
}

NamedSite Unknown(std::string_view name) {
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

NamedSite SiteCalled(std::string_view name) {
  std::vector<std::string> words = WordsOf(name);
  if (words.empty()) {
    return Unknown(name);
  }
  const Side side = TakeSide(words);
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
    return Unknown(name);
  }
  return {.code = "",
          .fault = side == Side::kMidline
                       ? fmt::format("'{0}' stands on both sides; say which, as '{1}_l' or '{1}_r'",
                                     name, named->landmark)
                       : fmt::format("'{}' has a side, and {} lies in the midline; write '{}'",
                                     name, SiteInWords(named->code), named->code)};
}

std::vector<std::string> OtherNamesOf(std::string_view landmark) {
  std::vector<std::string> names;
  for (const OtherName& other : kOtherNames) {
    if (other.landmark == landmark) {
      names.emplace_back(other.name);
    }
  }
  return names;
}

}  // namespace semblance
