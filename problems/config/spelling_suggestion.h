// SPDX-License-Identifier: GPL-3.0-or-later
// "did you mean": the known word that a mistyped one is nearest to.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace semblance {

// The least number of letters to insert, delete, replace or swap with their neighbour that makes
// `b` of `a` (optimal string alignment), upper and lower case being the same.
int EditDistance(std::string_view a, std::string_view b);

// The word of `known` nearest to `word`, the first of equals; or "" where none is near: at most a
// third of the longer word's letters may differ. A word that only lacks a unit ("radius" of
// "radius_mm") is near.
std::string NearestWord(std::string_view word, std::span<const std::string> known);

// "; did you mean 'x'?" where a word is near, else "; known are: a, b, c".
std::string Suggestion(std::string_view word, std::span<const std::string> known);

}  // namespace semblance
