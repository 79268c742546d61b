// SPDX-License-Identifier: GPL-3.0-or-later
// Bytes as text, for JSON, XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace semblance {

// RFC 4648, with padding.
std::string Base64(std::string_view bytes);

// The bytes again. Throws InputError for a text that is no Base64 with padding.
std::string FromBase64(std::string_view text);

}  // namespace semblance
