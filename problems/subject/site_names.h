// SPDX-License-Identifier: GPL-3.0-or-later
// What people call the sites: codes, the thesis's numbers, and plain names, with the side before or
// behind.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace semblance {

// What a name was taken for.
struct NamedSite {
  std::string code;   // standard or further (sites.h); empty where the name is not understood
  std::string fault;  // what is wrong then, and what to do; else empty
};

// The site of a name, standard or further. Upper and lower case, blanks, '_', '-', '.' and
// parentheses make no difference, but that sM2 and its like may be written either way. The landmark
// is a code ("go"), its number in the thesis (18) or a name ("gonion", "end of nasals", "rhinion");
// the side is l, r, left or right, before or behind ("left gonion", "Gonion (L)", "go_L", "18r"). A
// landmark in the midline takes no side; one of a pair needs it.
NamedSite SiteCalled(std::string_view name);

// What a landmark ("go", sites.h) is called beside its code, number and printed name.
std::vector<std::string> OtherNamesOf(std::string_view landmark);

}  // namespace semblance
