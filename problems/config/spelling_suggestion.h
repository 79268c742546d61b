// SPDX-License-Identifier: GPL-3.0-or-later
// "Did you mean": finds the known word that a mistyped word is nearest to.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace semblance::problems {

// Returns the least number of letters to insert, delete, replace or swap with their neighbour that
// turns `a` into `b` (optimal string alignment). Ignores upper and lower case.
int EditDistance(std::string_view a, std::string_view b);

// Returns the word of `known` that is nearest to `word` (the first of equals), or "" if none is
// near: at most a third of the longer word's letters may differ. A word that only lacks an ending
// such as a unit ("radius" of "radius_mm") counts as near.
std::string NearestWord(std::string_view word, std::span<const std::string> known);

// Returns "; did you mean 'x'?" if a known word is near, else "; known are: a, b, c".
std::string Suggestion(std::string_view word, std::span<const std::string> known);

}  // namespace semblance::problems
