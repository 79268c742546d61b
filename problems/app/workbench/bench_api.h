// SPDX-License-Identifier: GPL-3.0-or-later
// The HTTP interface of a workbench without sockets.
#pragma once

#include "problems/app/workbench/bench.h"
#include "problems/app/workbench/page_request.h"

namespace semblance::problems {

// Never throws. The page shows the reason of an impossible action: status 200 with {"refused":
// words}, a key that no other reply has. A request that the page never makes gets 400, 404 or 405
// with {"error": words}. A failure of the program gets 500 or 507.
PageReply Answer(Bench& bench, const PageRequest& request);

}  // namespace semblance::problems
