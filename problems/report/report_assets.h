// SPDX-License-Identifier: GPL-3.0-or-later
// The files that every report carries; CMake puts their text into the program.
#pragma once

#include <string_view>

namespace semblance {

std::string_view ReportStyle();        // report.css
std::string_view ReportPageScript();   // report_page.js
std::string_view ReportViewScript();   // report_view.js and the files it is made of
std::string_view ReportPartsScript();  // those files alone, for other pages
std::string_view ThreeScript();        // three.js; empty if the program was built without it

}  // namespace semblance
