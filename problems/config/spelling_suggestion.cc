// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/config/spelling_suggestion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <vector>

namespace semblance::problems {
namespace {

char Lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

bool LacksOnlyEnding(std::string_view word, std::string_view known) {
  return !word.empty() && known.size() > word.size() && known.starts_with(word) &&
         known[word.size()] == '_';
}

}  // namespace

int EditDistance(std::string_view a, std::string_view b) {
  const std::size_t width = b.size() + 1;
  std::vector<int> cost((a.size() + 1) * width);
  const auto at = [&](std::size_t i, std::size_t j) -> int& { return cost[i * width + j]; };
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        at(i, j) = static_cast<int>(i + j);
        continue;
      }
      const bool same = Lower(a[i - 1]) == Lower(b[j - 1]);
      at(i, j) = std::min({at(i - 1, j) + 1, at(i, j - 1) + 1, at(i - 1, j - 1) + (same ? 0 : 1)});
      if (i > 1 && j > 1 && Lower(a[i - 1]) == Lower(b[j - 2]) &&
          Lower(a[i - 2]) == Lower(b[j - 1])) {
        at(i, j) = std::min(at(i, j), at(i - 2, j - 2) + 1);
      }
    }
  }
  return cost.back();
}

std::string NearestWord(std::string_view word, std::span<const std::string> known) {
  std::string nearest;
  int least = static_cast<int>(word.size()) + 1;
  for (const std::string& candidate : known) {
    const int longer = static_cast<int>(std::max(word.size(), candidate.size()));
    const int shorter = static_cast<int>(std::min(word.size(), candidate.size()));
    if (!LacksOnlyEnding(word, candidate) && 3 * (longer - shorter) > std::max(longer, 3)) {
      continue;  // the lengths alone rule it out; a word may be as long as a file
    }
    const int distance = LacksOnlyEnding(word, candidate) ? 1 : EditDistance(word, candidate);
    if (distance < least && 3 * distance <= std::max(longer, 3)) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

std::string Suggestion(std::string_view word, std::span<const std::string> known) {
  const std::string nearest = NearestWord(word, known);
  if (!nearest.empty()) {
    return fmt::format("; did you mean '{}'?", nearest);
  }
  return known.empty() ? "" : fmt::format("; known are: {}", fmt::join(known, ", "));
}

}  // namespace semblance::problems
