// SPDX-License-Identifier: GPL-3.0-or-later
// The HTTP interface of a workbench without sockets: a request of the page (method, path, query,
// body) and the reply to it.
#pragma once

#include <map>
#include <string>

#include "problems/app/workbench/bench.h"

namespace semblance::problems {

struct BenchRequest {
  std::string method;                        // GET or POST
  std::string path;                          // below the token, e.g. "api/state"
  std::map<std::string, std::string> query;  // decoded
  std::string body;
};

struct BenchReply {
  int status = 500;  // HTTP status
  std::string type = "text/plain; charset=utf-8";
  std::string body = "no reply";
  std::string download_name;  // if the browser should save the body as a file
};

// Never throws. The page shows the reason of an impossible action: status 200 with {"refused":
// words}, a key that no other reply has. A request that the page never makes gets 400, 404 or 405
// with {"error": words}. A failure of the program gets 500 or 507.
BenchReply Answer(Bench& bench, const BenchRequest& request);

}  // namespace semblance::problems
