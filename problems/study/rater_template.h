// SPDX-License-Identifier: GPL-3.0-or-later
// The page for raters, embedded by CMake.
#pragma once

#include <string_view>

namespace semblance::problems {

// rater_page.html. The word SEMBLANCE_RATER_DATA stands for the JSON of its questions:
// {page, seed, pictures[data URI], questions[{id, face, candidates[{code, picture}]}]}.
std::string_view RaterTemplate();

}  // namespace semblance::problems
