// SPDX-License-Identifier: GPL-3.0-or-later
// The only server of the program. It listens on the loopback address of this machine, for one
// person who has the URL.
#pragma once

#include <cstddef>
#include <memory>
#include <stop_token>
#include <string>

#include "problems/app/workbench/http_connections.h"
#include "problems/app/workbench/page_request.h"

namespace semblance::problems {

struct HttpServerOptions {
  int port = 0;                              // of 127.0.0.1; 0: any free port
  std::string token;                         // first part of every path; empty: a new random one
  std::size_t max_body_bytes = 1 << 20;      // limit of a request's body
  std::size_t max_upload_bytes = 512 << 20;  // limit of a file from the browser
  HttpLimits limits;                         // of heads and connections
};

// Every request must have the token in its path (compared in constant time), this machine as its
// Host and, if it has an Origin, this page as its Origin. A POST must have an Origin. The server
// refuses any other request before it reads the body. A page below run/ may contain its scripts and
// gets an origin of its own; all other pages load their scripts from this server.
class HttpServer {
 public:
  // Starts to listen. Throws IoError if the port is taken.
  HttpServer(AnswerPage answer, const HttpServerOptions& options = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int Port() const;
  std::string Url() const;  // with the token

  // Answers requests until a stop is requested. A stop requested before the call counts too.
  void Serve(const std::stop_token& stop);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// 64 hexadecimal digits from the system's source of random numbers. Throws IoError if the system
// has no such source.
std::string RandomToken();

}  // namespace semblance::problems
