// SPDX-License-Identifier: GPL-3.0-or-later
// What the page may ask of a workbench: a method, a path and a body, and the answer to them. Knows
// no sockets.
#pragma once

#include <map>
#include <string>

#include "problems/workbench/bench.h"

namespace semblance {

struct BenchRequest {
  std::string method;                        // GET or POST
  std::string path;                          // below the token, e.g. "api/state"
  std::map<std::string, std::string> query;  // decoded
  std::string body;
};

struct BenchReply {
  int status = 500;  // of HTTP
  std::string type = "text/plain; charset=utf-8";
  std::string body = "not answered";
  std::string download_name;  // where the browser is to keep it as a file
};

// Never throws. What is refused to a person is 200 with {"refused": words}, for the page to show:
// no address of it answers so else. A request that the page does not make is 400, 404 or 405 with
// {"error": words}; what failed in the program, 500 or 507.
BenchReply Answer(Bench& bench, const BenchRequest& request);

}  // namespace semblance
