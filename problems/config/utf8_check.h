// SPDX-License-Identifier: GPL-3.0-or-later
// What is wrong with the bytes of a configuration, or of another text, before any of it is parsed.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "problems/config/config_errors.h"

namespace semblance {

// Adds an error for each line with a tab (which looks like spaces but is none; lines that are
// comments may have them) or another control character, and for bytes that are not UTF-8. True if
// there were none.
bool RequireReadableBytes(std::string_view text, const std::shared_ptr<const ConfigSource>& source,
                          ConfigErrors& errors);

// The line, from 1, of the first byte that is not UTF-8; nothing if there is none.
std::optional<int> LineThatIsNotUtf8(std::string_view text);

}  // namespace semblance
