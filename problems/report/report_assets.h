// SPDX-License-Identifier: GPL-3.0-or-later
// The style sheet and scripts that every report contains. CMake embeds their text in the program.
#pragma once

#include <string_view>

namespace semblance::problems {

std::string_view ReportStyle();        // report.css
std::string_view ReportPageScript();   // report_page.js
std::string_view ReportViewScript();   // report_view.js and the view_*.js files that it needs
std::string_view ReportPartsScript();  // the view_*.js files alone, for other pages
std::string_view ThreeScript();        // three.js; empty if the program was built without it

}  // namespace semblance::problems
