// SPDX-License-Identifier: GPL-3.0-or-later
// Plain text inside HTML, SVG and XML.
#pragma once

#include <string>
#include <string_view>

namespace semblance {

// & < > " ' as entities; control characters that HTML forbids as a replacement character.
std::string EscapeHtml(std::string_view text);

}  // namespace semblance
