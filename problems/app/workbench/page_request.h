// SPDX-License-Identifier: GPL-3.0-or-later
// A request of a page in the browser, and the reply to it, without sockets.
#pragma once

#include <functional>
#include <map>
#include <string>

namespace semblance::problems {

struct PageRequest {
  std::string method;                        // GET or POST
  std::string path;                          // below the token, e.g. "api/state"
  std::map<std::string, std::string> query;  // decoded
  std::string body;
};

struct PageReply {
  int status = 500;  // HTTP status
  std::string type = "text/plain; charset=utf-8";
  std::string body = "no reply";
  std::string download_name;  // if the browser should save the body as a file
};

// Must not throw. Called from several threads at a time.
using AnswerPage = std::function<PageReply(const PageRequest&)>;

}  // namespace semblance::problems
