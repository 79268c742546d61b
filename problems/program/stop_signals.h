// SPDX-License-Identifier: GPL-3.0-or-later
// Ctrl-C and SIGTERM.
#pragma once

#include <stop_token>

namespace semblance {

// From here on the first of these signals asks the work to stop, through the token. Work that has
// not seen that after a second is ended where it stands, with kNotUsable: no file is ever half
// written, and what lies about is cleared by the next run. A second signal ends at once. SIGINT
// stays ignored where it was, as in a job in the background.
std::stop_token StopOnSignals();

// For a command that has seen the stop and ends by itself: the second of grace is taken back. A
// second signal still ends the program at once.
void EndInOwnTime();

}  // namespace semblance
