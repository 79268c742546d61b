// SPDX-License-Identifier: GPL-3.0-or-later
// The one thing of the program that listens: on the loopback address of this machine, for one
// person who has the URL.
#pragma once

#include <cstddef>
#include <memory>
#include <stop_token>
#include <string>

#include "problems/workbench/bench.h"

namespace semblance {

struct HttpServerOptions {
  int port = 0;                               // of 127.0.0.1; 0: any that is free
  std::string token;                          // first part of every path; empty: a new random one
  std::size_t most_bytes = 1 << 20;           // of a request's body
  std::size_t most_upload_bytes = 512 << 20;  // of a file from the browser
};

// Every request must carry the token in its path (compared in constant time), this machine as its
// Host and, where the browser tells one, this page as its Origin; what is posted must tell it. All
// else is refused before its body is read.
class HttpServer {
 public:
  // Listens from now on. Throws IoError if the port is taken.
  HttpServer(Bench& bench, const HttpServerOptions& options = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int Port() const;
  std::string Url() const;  // with the token

  // Answers until a stop is asked for, be it before it begins.
  void Serve(const std::stop_token& stop);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// 64 hexadecimal digits from the system's source of random numbers. Throws IoError without one.
std::string RandomToken();

}  // namespace semblance
