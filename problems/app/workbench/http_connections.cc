// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/http_connections.h"

#include <fmt/format.h>
#include <httplib.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <limits>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"

namespace semblance::problems {
namespace {

using Clock = std::chrono::steady_clock;

// ---------------------------------------------------------------------------------------------
// Heads
// ---------------------------------------------------------------------------------------------

constexpr std::string_view kLineEnd = "\r\n", kHeadEnd = "\r\n\r\n";

HeadReading Refuse(int status, const char* words) { return {.fault = status, .words = words}; }

// True if all control characters are tabs, or CR and LF together. The last byte may be the CR of a
// pair that has not arrived yet.
bool HasOnlyLineEnds(std::string_view text) {
  for (std::size_t k = 0; k < text.size(); ++k) {
    const auto c = static_cast<unsigned char>(text[k]);
    const bool is_cr = c == '\r' && (k + 1 == text.size() || text[k + 1] == '\n');
    const bool is_lf = c == '\n' && k > 0 && text[k - 1] == '\r';
    if ((c < ' ' && c != '\t' && !is_cr && !is_lf) || c == 0x7f) {
      return false;
    }
  }
  return true;
}

bool IsHeaderName(std::string_view name) {
  constexpr std::string_view kSigns = "!#$%&'*+-.^_`|~";
  return !name.empty() && std::ranges::all_of(name, [&](unsigned char c) {
    return std::isalnum(c) != 0 || kSigns.find(static_cast<char>(c)) != std::string_view::npos;
  });
}

std::string_view TrimmedSpaces(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t");
  return from == std::string_view::npos
             ? std::string_view()
             : text.substr(from, text.find_last_not_of(" \t") - from + 1);
}

constexpr std::uint64_t kUnknownSize = std::numeric_limits<std::uint64_t>::max();

std::uint64_t ParseSize(std::string_view text) {
  std::uint64_t size = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, size);
  return error == std::errc() && at == end ? size : kUnknownSize;
}

// The headers that decide where a request ends, and one that is refused.
struct BodyHeaders {
  int lengths = 0;
  bool is_encoded = false;
  bool has_range = false;
  std::uint64_t size = 0;
};

// Returns false if the line is no header.
bool ReadHeader(std::string_view line, BodyHeaders& headers) {
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos || !IsHeaderName(line.substr(0, colon))) {
    return false;
  }
  const std::string name = LowerCase(std::string(line.substr(0, colon)));
  if (name == "content-length") {
    ++headers.lengths;
    headers.size = ParseSize(TrimmedSpaces(line.substr(colon + 1)));
  }
  headers.is_encoded = headers.is_encoded || name == "transfer-encoding";
  headers.has_range = headers.has_range || name == "range";
  return true;
}

HeadReading ReadWholeHead(std::string_view head) {
  BodyHeaders headers;
  std::size_t at = head.find(kLineEnd) + kLineEnd.size();  // behind the request line
  while (at < head.size()) {
    const std::size_t end = std::min(head.find(kLineEnd, at), head.size());
    if (!ReadHeader(head.substr(at, end - at), headers)) {
      return Refuse(400, "a line of the head is no header");
    }
    at = end + kLineEnd.size();
  }
  if (headers.lengths > 1) {
    return Refuse(400, "the head has more than one Content-Length");
  }
  if (headers.lengths == 1 && headers.is_encoded) {
    return Refuse(400, "the head has both Content-Length and Transfer-Encoding");
  }
  if (headers.has_range) {  // httplib would read it by a recursion as deep as the line is long
    return Refuse(400, "parts of a file are not sent; leave out the header Range");
  }
  return {.size = head.size() + kLineEnd.size(),
          .body = headers.is_encoded ? kUnknownSize : headers.size};
}

// ---------------------------------------------------------------------------------------------
// Connections
// ---------------------------------------------------------------------------------------------

class Connection : public HttpConnection {
 public:
  Connection(int socket, std::chrono::milliseconds idle_time, std::stop_token stop)
      : socket_(socket), idle_time_(idle_time), stop_(std::move(stop)) {}
  ~Connection() override { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  int Socket() const { return socket_; }
  const std::string& Received() const { return received_; }

  Clock::time_point deadline;  // of the head that is being received

  // Appends what has arrived, up to `max_bytes` in all. Returns false at the end of the connection.
  bool Receive(std::size_t max_bytes) {
    const std::size_t before = received_.size();
    received_.resize(max_bytes);
    const ssize_t got = ::recv(socket_, received_.data() + before, max_bytes - before, 0);
    received_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return got > 0 || (got < 0 && (errno == EAGAIN || errno == EINTR));
  }

  // Begins a request of `size` bytes, head and body.
  void Begin(std::uint64_t size) { unread_ = size; }
  // True if the request was read to its end, so that another one can follow.
  bool IsAtEnd() const { return unread_ == 0; }

  std::ptrdiff_t Read(char* bytes, std::size_t size) override {
    size = std::min<std::uint64_t>(size, unread_);
    std::ptrdiff_t got = static_cast<std::ptrdiff_t>(std::min(size, received_.size()));
    if (got > 0) {
      std::copy_n(received_.begin(), got, bytes);
      received_.erase(0, static_cast<std::size_t>(got));
    } else if (size > 0) {
      got = Transfer(POLLIN, [&] { return ::recv(socket_, bytes, size, 0); });
    }
    unread_ -= static_cast<std::uint64_t>(std::max<std::ptrdiff_t>(got, 0));
    return got;
  }

  std::ptrdiff_t Write(const char* bytes, std::size_t size) override {
    return Transfer(POLLOUT, [&] { return ::send(socket_, bytes, size, MSG_NOSIGNAL); });
  }

  // Sends a short reply without waiting. The connection is closed afterwards.
  void SendRefusal(const HeadReading& head) const {
    const std::string body = fmt::format("{{\"error\":\"{}\"}}", head.words);
    const std::string reply = fmt::format(
        "HTTP/1.1 {} Refused\r\nConnection: close\r\nContent-Type: application/json\r\n"
        "Content-Length: {}\r\n\r\n{}",
        head.fault, body.size(), body);
    [[maybe_unused]] const auto sent =
        ::send(socket_, reply.data(), reply.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

 private:
  // Waits until the socket is ready, and transfers. Gives up when the client has been idle for too
  // long, and when the server has been stopped.
  template <class Function>
  std::ptrdiff_t Transfer(short event, const Function& transfer) {
    constexpr int kStopCheck_ms = 50;
    const Clock::time_point end = Clock::now() + idle_time_;
    while (!IsStopped(event) && Clock::now() < end) {
      const ssize_t done = transfer();
      if (done >= 0 || (errno != EAGAIN && errno != EINTR)) {
        return done;
      }
      pollfd waiting{.fd = socket_, .events = event, .revents = 0};
      ::poll(&waiting, 1, kStopCheck_ms);
    }
    return -1;
  }

  // A request ends when the server is stopped; a reply has some time to arrive as a whole.
  bool IsStopped(short event) {
    constexpr std::chrono::seconds kTimeToFinish{2};
    if (stop_.stop_requested() && !stopped_) {
      stopped_ = Clock::now();
    }
    return stopped_ && (event != POLLOUT || Clock::now() - *stopped_ > kTimeToFinish);
  }

  int socket_;
  std::chrono::milliseconds idle_time_;
  std::stop_token stop_;
  std::optional<Clock::time_point> stopped_;  // when a transfer first noticed the stop
  std::string received_;
  std::uint64_t unread_ = 0;  // bytes of the present request
};

using ConnectionPointer = std::shared_ptr<Connection>;

// Wakes a thread that polls.
class Wake {
 public:
  Wake() : descriptor_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (descriptor_ < 0) {
      throw IoError("the system gives no event descriptor, which the workbench needs");
    }
  }
  ~Wake() { ::close(descriptor_); }
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;

  int Descriptor() const { return descriptor_; }
  void Set() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(descriptor_, &one, sizeof one);
  }
  void Reset() const {
    std::uint64_t count = 0;
    [[maybe_unused]] const auto got = ::read(descriptor_, &count, sizeof count);
  }

 private:
  int descriptor_;
};

class ConnectionLoop {
 public:
  ConnectionLoop(int socket, const HttpLimits& limits, const AnswerRequest& answer,
                 std::stop_token stop)
      : socket_(socket), limits_(limits), answer_(answer), stop_(std::move(stop)) {}

  void Run() {
    const std::stop_callback wake_at_stop(stop_, [this] { wake_.Set(); });
    httplib::ThreadPool threads(static_cast<std::size_t>(limits_.threads));
    threads_ = &threads;
    while (!stop_.stop_requested()) {
      const std::vector<ConnectionPointer> ready = WaitForClients();
      for (const ConnectionPointer& connection : ready) {
        connection->Receive(limits_.max_head_bytes) ? Advance(connection) : Drop(connection);
      }
      TakeBack();
      Accept();
      DropLate();
    }
    threads.shutdown();
  }

 private:
  // Returns the waiting connections that have sent something.
  std::vector<ConnectionPointer> WaitForClients() {
    std::vector<pollfd> polled = {{.fd = socket_, .events = POLLIN, .revents = 0},
                                  {.fd = wake_.Descriptor(), .events = POLLIN, .revents = 0}};
    const std::vector<ConnectionPointer> all(waiting_.begin(), waiting_.end());
    for (const ConnectionPointer& connection : all) {
      polled.push_back({.fd = connection->Socket(), .events = POLLIN, .revents = 0});
    }
    ::poll(polled.data(), polled.size(), TimeToDeadline_ms());
    wake_.Reset();
    std::vector<ConnectionPointer> ready;
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (polled[k + 2].revents != 0) {
        ready.push_back(all[k]);
      }
    }
    return ready;
  }

  // The oldest connection stands in front; its deadline is the first.
  int TimeToDeadline_ms() const {
    if (waiting_.empty()) {
      return -1;
    }
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(waiting_.front()->deadline - Clock::now());
    return static_cast<int>(std::max<std::int64_t>(left.count(), 0));
  }

  void Wait(const ConnectionPointer& connection) {
    connection->deadline = Clock::now() + limits_.head_time;
    waiting_.push_back(connection);
    Advance(connection);
  }

  void Drop(const ConnectionPointer& connection) { waiting_.remove(connection); }

  // Refuses the head, or gives it to a thread if it is complete.
  void Advance(const ConnectionPointer& connection) {
    const HeadReading head = ReadHead(connection->Received(), limits_);
    if (head.fault != 0) {
      connection->SendRefusal(head);
      Drop(connection);
    } else if (head.size > 0) {
      Drop(connection);
      connection->Begin(head.body == kUnknownSize ? kUnknownSize : head.size + head.body);
      threads_->enqueue([this, connection] { Answer(connection); });
    }
  }

  void Answer(const ConnectionPointer& connection) {
    if (answer_(*connection) && connection->IsAtEnd()) {
      const std::lock_guard lock(mutex_);
      answered_.push_back(connection);
      wake_.Set();
    }
  }

  // Connections that were answered wait for their next request.
  void TakeBack() {
    std::vector<ConnectionPointer> answered;
    {
      const std::lock_guard lock(mutex_);
      answered.swap(answered_);
    }
    for (const ConnectionPointer& connection : answered) {
      Wait(connection);
    }
  }

  void Accept() {
    constexpr int kMostAtOnce = 64;  // the connections that wait get their turn too
    for (int k = 0; k < kMostAtOnce; ++k) {
      const int socket = ::accept4(socket_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (socket < 0 && errno != EMFILE && errno != ENFILE) {
        return;
      }
      if (socket < 0 || waiting_.size() >= limits_.max_waiting) {
        DropOldest();
      }
      if (socket < 0) {
        return;  // the client waits for the next turn
      }
      // Head and body of a reply are written separately; the body must not wait.
      const int on = 1;
      ::setsockopt(socket, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      Wait(std::make_shared<Connection>(socket, limits_.idle_time, stop_));
    }
  }

  void DropOldest() {
    constexpr std::chrono::milliseconds kPause(10);
    if (waiting_.empty()) {
      std::this_thread::sleep_for(kPause);  // the requests that are answered hold all descriptors
    } else {
      waiting_.pop_front();
    }
  }

  void DropLate() {
    while (!waiting_.empty() && waiting_.front()->deadline <= Clock::now()) {
      if (!waiting_.front()->Received().empty()) {
        waiting_.front()->SendRefusal(Refuse(408, "the head of the request took too long"));
      }
      waiting_.pop_front();
    }
  }

  int socket_;
  const HttpLimits& limits_;
  const AnswerRequest& answer_;
  std::stop_token stop_;
  Wake wake_;
  httplib::ThreadPool* threads_ = nullptr;
  std::list<ConnectionPointer> waiting_;  // without a complete head, the oldest in front
  std::mutex mutex_;
  std::vector<ConnectionPointer> answered_;  // guarded by mutex_
};

}  // namespace

HeadReading ReadHead(std::string_view received, const HttpLimits& limits) {
  const std::size_t end = received.find(kHeadEnd);
  const bool is_whole = end != std::string_view::npos;
  const std::string_view head = received.substr(0, is_whole ? end + kLineEnd.size() : end);
  if (head.size() + kLineEnd.size() > limits.max_head_bytes) {
    return Refuse(431, "the head of the request is too long");
  }
  if (std::ranges::count(head, '\n') > limits.max_head_lines) {
    return Refuse(431, "the head of the request has too many lines");
  }
  if (!HasOnlyLineEnds(head)) {
    return Refuse(400, "the head of the request has control characters");
  }
  return is_whole ? ReadWholeHead(head) : HeadReading();
}

HttpConnections::HttpConnections(int port, const HttpLimits& limits)
    : limits_(limits), socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  auto* const generic = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof address;
  const int on = 1;  // the port of a program that has just ended may be used again
  ::setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(socket_, generic, size) != 0 || ::listen(socket_, SOMAXCONN) != 0 ||
      ::getsockname(socket_, generic, &size) != 0) {
    ::close(socket_);
    throw IoError(fmt::format(
        "port {} of 127.0.0.1 cannot be used; it may be taken: give another --port, or none",
        port));
  }
  port_ = ntohs(address.sin_port);
}

HttpConnections::~HttpConnections() { ::close(socket_); }

void HttpConnections::Serve(const AnswerRequest& answer, const std::stop_token& stop) {
  ConnectionLoop(socket_, limits_, answer, stop).Run();
}

}  // namespace semblance::problems
