// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/http_server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <openssl/crypto.h>
#include <sys/random.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "problems/app/workbench/http_connections.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

constexpr const char* kHost = "127.0.0.1";

// The page loads nothing from other addresses, and no other page may embed it in a frame.
constexpr const char* kPagePolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
// A report contains its scripts. The sandbox gives it a separate origin.
constexpr const char* kReportPolicy =
    "sandbox allow-scripts allow-downloads; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'";

bool SameText(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

struct Refusal {
  int status;
  const char* words;
};

std::optional<std::uint64_t> ParseNumber(const std::string& text) {
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && at == end && !text.empty() ? std::optional(number) : std::nullopt;
}

bool HasControlCharacter(const std::string& text) {
  return std::ranges::any_of(text, [](unsigned char c) { return c < ' ' || c == 0x7f; });
}

// A connection as httplib sees it.
class ConnectionStream : public httplib::Stream {
 public:
  explicit ConnectionStream(HttpConnection& connection) : connection_(connection) {}

  // Both wait, if necessary.
  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* bytes, std::size_t size) override { return connection_.Read(bytes, size); }
  ssize_t write(const char* bytes, std::size_t size) override {
    return connection_.Write(bytes, size);
  }
  void get_remote_ip_and_port(std::string& ip, int& port) const override { NoAddress(ip, port); }
  void get_local_ip_and_port(std::string& ip, int& port) const override { NoAddress(ip, port); }
  socket_t socket() const override { return INVALID_SOCKET; }

 private:
  static void NoAddress(std::string& ip, int& port) {
    ip.clear();
    port = 0;
  }

  HttpConnection& connection_;
};

// Answers requests on connections that HttpConnections has accepted.
class RequestServer : public httplib::Server {
 public:
  // httplib stops a reply without a listening socket, which it takes for its own shutdown.
  RequestServer() { svr_sock_ = 0; }

  // Calls `look` with the request before it is answered. Returns false if the connection must be
  // closed.
  bool AnswerOne(HttpConnection& connection, const std::function<void(httplib::Request&)>& look) {
    ConnectionStream stream(connection);
    bool must_close = false;
    return process_request(stream, /*close_connection=*/false, must_close, look) && !must_close;
  }
};

void Refuse(const Refusal& refusal, httplib::Response& response) {
  response.status = refusal.status;
  response.set_header("Connection", "close");  // an unread body may follow
  response.set_content(nlohmann::json{{"error", refusal.words}}.dump(), "application/json");
}

}  // namespace

struct HttpServer::Impl {
  AnswerPage answer;
  HttpServerOptions options;
  HttpConnections connections;
  RequestServer server;
  int port;

  Impl(AnswerPage the_answer, const HttpServerOptions& the_options)
      : answer(std::move(the_answer)),
        options(the_options),
        connections(options.port, options.limits),
        port(connections.Port()) {}

  bool IsOwnHost(const std::string& host) const {
    return host == fmt::format("{}:{}", kHost, port) || host == fmt::format("localhost:{}", port);
  }

  bool IsOwnOrigin(const std::string& origin) const {
    constexpr std::string_view kScheme = "http://";
    return origin.starts_with(kScheme) && IsOwnHost(origin.substr(kScheme.size()));
  }

  // Returns "rest" of "/TOKEN/rest", or none for another token.
  std::optional<std::string> BelowToken(const std::string& path) const {
    const std::size_t slash = path.find('/', 1);
    const bool fits = path.size() > 1 && slash != std::string::npos &&
                      SameText(path.substr(1, slash - 1), options.token);
    return fits ? std::optional(path.substr(slash + 1)) : std::nullopt;
  }

  std::optional<Refusal> CheckBody(const httplib::Request& request, const std::string& path) const {
    const bool is_upload = path == "api/upload";
    const auto size = ParseNumber(request.get_header_value("Content-Length"));
    if (!size || request.has_header("Transfer-Encoding")) {
      return Refusal{411, "a POST needs the header Content-Length"};
    }
    if (*size > (is_upload ? options.max_upload_bytes : options.max_body_bytes)) {
      return Refusal{413, "the body is too large"};
    }
    const std::string type = request.get_header_value("Content-Type");
    if (type != (is_upload ? "application/octet-stream" : "application/json")) {
      return Refusal{415, "this address takes another Content-Type"};
    }
    return std::nullopt;
  }

  // Returns the reason to refuse the request, or none.
  std::optional<Refusal> Check(const httplib::Request& request) const {
    if (request.get_header_value_count("Host") != 1 ||
        !IsOwnHost(request.get_header_value("Host"))) {
      return Refusal{403, "this address is not for that host"};
    }
    const auto path = BelowToken(request.path);
    if (!path) {
      return Refusal{403, "the address lacks the token; open the one that the program printed"};
    }
    if (HasControlCharacter(request.path)) {
      return Refusal{400, "the address has control characters"};
    }
    const bool posts = request.method == "POST";
    if (!posts && request.method != "GET") {
      return Refusal{405, "only GET and POST are answered"};
    }
    const bool has_origin = request.has_header("Origin");
    if ((posts && !has_origin) ||
        (has_origin && !IsOwnOrigin(request.get_header_value("Origin")))) {
      return Refusal{403, "this address is not for that origin"};
    }
    return posts ? CheckBody(request, *path) : std::nullopt;
  }

  // Sends the body uncompressed. httplib would compress a body set as content with Brotli, which
  // takes a browser on this machine longer than making the face does.
  static void SetBody(httplib::Response& response, const std::string& text,
                      const std::string& type) {
    const auto body = std::make_shared<const std::string>(text);
    response.set_content_provider(
        body->size(), type,
        [body](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
          return sink.write(body->data() + offset, length);
        });
  }

  void Reply(const httplib::Request& request, httplib::Response& response) {
    PageRequest page_request{request.method, *BelowToken(request.path), {}, request.body};
    for (const auto& [key, value] : request.params) {
      page_request.query[key] = value;
    }
    const PageReply reply = answer(page_request);
    response.status = reply.status;
    if (page_request.path.starts_with("run/")) {
      response.headers.erase("Content-Security-Policy");
      response.set_header("Content-Security-Policy", kReportPolicy);
    }
    if (!reply.download_name.empty()) {
      response.set_header("Content-Disposition",
                          fmt::format("attachment; filename=\"{}\"", reply.download_name));
    }
    SetBody(response, reply.body, reply.type);
  }

  void Prepare() {
    server.set_payload_max_length(options.max_upload_bytes);
    server.set_default_headers({{"Content-Security-Policy", kPagePolicy},
                                {"X-Content-Type-Options", "nosniff"},
                                {"Referrer-Policy", "no-referrer"},
                                {"Cross-Origin-Resource-Policy", "same-origin"},
                                {"Cross-Origin-Opener-Policy", "same-origin"},
                                {"Cache-Control", "no-store"}});
    server.set_pre_routing_handler(
        [this](const httplib::Request& request, httplib::Response& response) {
          const std::optional<Refusal> refusal = Check(request);
          if (refusal) {
            Refuse(*refusal, response);
          }
          return refusal ? httplib::Server::HandlerResponse::Handled
                         : httplib::Server::HandlerResponse::Unhandled;
        });
    const auto reply = [this](const httplib::Request& request, httplib::Response& response) {
      Reply(request, response);
    };
    server.Get(".*", reply);
    server.Post(".*", reply);
  }

  // A request that is refused ends its connection, because its body is not read.
  bool AnswerOne(HttpConnection& connection) {
    bool is_allowed = false;
    const bool goes_on = server.AnswerOne(
        connection, [&](const httplib::Request& request) { is_allowed = !Check(request); });
    return goes_on && is_allowed;
  }
};

HttpServer::HttpServer(AnswerPage answer, const HttpServerOptions& options)
    : impl_(std::make_unique<Impl>(std::move(answer), options)) {
  if (impl_->options.token.empty()) {
    impl_->options.token = RandomToken();
  }
  impl_->Prepare();
}

HttpServer::~HttpServer() = default;

int HttpServer::Port() const { return impl_->port; }

std::string HttpServer::Url() const {
  return fmt::format("http://{}:{}/{}/", kHost, impl_->port, impl_->options.token);
}

void HttpServer::Serve(const std::stop_token& stop) {
  impl_->connections.Serve(
      [this](HttpConnection& connection) { return impl_->AnswerOne(connection); }, stop);
}

std::string RandomToken() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw IoError("the system gives no random numbers, which a page needs for its address");
  }
  std::string token;
  for (const unsigned char byte : bytes) {
    token += fmt::format("{:02x}", byte);
  }
  return token;
}

}  // namespace semblance::problems
