// SPDX-License-Identifier: GPL-3.0-or-later
// The connections of the workbench. One thread accepts them and reads the head of each request
// within limits; only a complete and sound head gets one of the threads that answer. So a client
// that sends slowly, or without end, takes a few kilobytes and keeps nobody else waiting.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

namespace semblance::problems {

struct HttpLimits {
  std::size_t max_head_bytes = 8192;           // request line and headers
  int max_head_lines = 100;                    // the same
  std::chrono::milliseconds head_time{5000};   // from the first moment to the end of the head
  std::chrono::milliseconds idle_time{10000};  // without progress, in a body or a reply
  std::size_t max_waiting = 512;  // connections without a complete head; the oldest one is closed
  int threads = 8;                // requests that are answered at a time
};

// The result of reading a head. With neither `fault` nor `size` the head is incomplete.
struct HeadReading {
  int fault = 0;           // HTTP status of the refusal
  const char* words = "";  // its reason
  std::size_t size = 0;    // bytes of the complete head
  std::uint64_t body = 0;  // bytes of the body; the largest number if this is unknown
};

// Reads the head at the start of `received`. Refuses a head beyond the limits, control characters,
// lines that do not end in CR LF, lines that are no header, two Content-Length (also equal ones),
// and Content-Length beside Transfer-Encoding: with them two readers would see different requests.
// Refuses the header Range too.
HeadReading ReadHead(std::string_view received, const HttpLimits& limits);

// A connection whose request is complete up to its head.
class HttpConnection {
 public:
  virtual ~HttpConnection() = default;
  // Return the number of bytes, 0 at the end, or -1 after an error or a stop, or if the client is
  // idle for too long.
  virtual std::ptrdiff_t Read(char* bytes, std::size_t size) = 0;
  virtual std::ptrdiff_t Write(const char* bytes, std::size_t size) = 0;
};

// Answers one request. Returns true if the connection may go on with another one. Called from
// several threads.
using AnswerRequest = std::function<bool(HttpConnection&)>;

class HttpConnections {
 public:
  // Listens on 127.0.0.1. port: 0 for any free port. Throws IoError if the port is taken.
  HttpConnections(int port, const HttpLimits& limits);
  ~HttpConnections();
  HttpConnections(const HttpConnections&) = delete;
  HttpConnections& operator=(const HttpConnections&) = delete;

  int Port() const { return port_; }

  // Serves until a stop is requested. A stop requested before the call counts too.
  void Serve(const AnswerRequest& answer, const std::stop_token& stop);

 private:
  HttpLimits limits_;
  int socket_ = -1;
  int port_ = -1;
};

}  // namespace semblance::problems
