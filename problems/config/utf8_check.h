// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the bytes of a configuration, or of another text, before it is parsed.
#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "problems/config/config_tree.h"

namespace semblance::problems {

// Adds an error for each line that has a tab outside a comment (it looks like spaces), another
// control character, or a byte that is not UTF-8. Returns true if there is none.
bool RequireReadableBytes(std::string_view text, const std::shared_ptr<const ConfigSource>& source,
                          ConfigErrors& errors);

// Returns the line, from 1, of the first byte that is not UTF-8, or nothing.
std::optional<int> LineThatIsNotUtf8(std::string_view text);

}  // namespace semblance::problems
