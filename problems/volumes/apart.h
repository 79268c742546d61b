// SPDX-License-Identifier: GPL-3.0-or-later
// Work with a library that may end the program: it is done in a process of its own.
#pragma once

#include <functional>
#include <stop_token>
#include <string>

namespace semblance {

// With this the work says which file is at hand.
using TellFile = std::function<void(const std::string& file)>;

// What `work` returns. It is done by a copy of this process, which has `memory_bytes` more than
// this one has now, 1 s of processor and one more for each 100 MB of it from each file that is told
// on, and whose terminal is closed; nothing else of what it does is seen here. Throws what the work
// throws of InputError and IoError; IoError, which names the file at hand, where the work fails in
// another way, asks for more memory or time or ends its process; Cancelled soon after a stop is
// asked for.
std::string DoApart(const std::function<std::string(const TellFile&)>& work, double memory_bytes,
                    const std::stop_token& stop);

}  // namespace semblance
