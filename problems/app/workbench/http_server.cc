// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/workbench/http_server.h"

#include <fmt/format.h>
#include <httplib.h>
#include <openssl/crypto.h>
#include <sys/random.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "problems/app/workbench/bench_api.h"
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

void Refuse(const Refusal& refusal, httplib::Response& response) {
  response.status = refusal.status;
  response.set_header("Connection", "close");  // an unread body may follow
  response.set_content(nlohmann::json{{"error", refusal.words}}.dump(), "application/json");
}

}  // namespace

struct HttpServer::Impl {
  Bench& bench;
  HttpServerOptions options;
  httplib::Server server;
  int port = -1;

  Impl(Bench& the_bench, const HttpServerOptions& the_options)
      : bench(the_bench), options(the_options) {}

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
    BenchRequest bench_request{request.method, *BelowToken(request.path), {}, request.body};
    for (const auto& [key, value] : request.params) {
      bench_request.query[key] = value;
    }
    const BenchReply reply = Answer(bench, bench_request);
    response.status = reply.status;
    if (bench_request.path.starts_with("run/")) {
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
    server.set_keep_alive_max_count(1000);
    // httplib writes head and body separately, so that the rest of a body would wait otherwise.
    server.set_tcp_nodelay(true);
    server.set_read_timeout(10, 0);
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

  void Listen() {
    const bool listens = options.port == 0 ? (port = server.bind_to_any_port(kHost)) > 0
                                           : server.bind_to_port(kHost, options.port);
    if (!listens) {
      throw IoError(
          fmt::format("port {} of {} cannot be used; it may be taken: give another --port, or none",
                      options.port, kHost));
    }
    port = options.port == 0 ? port : options.port;
  }
};

HttpServer::HttpServer(Bench& bench, const HttpServerOptions& options)
    : impl_(std::make_unique<Impl>(bench, options)) {
  if (impl_->options.token.empty()) {
    impl_->options.token = RandomToken();
  }
  impl_->Prepare();
  impl_->Listen();
}

HttpServer::~HttpServer() = default;

int HttpServer::Port() const { return impl_->port; }

std::string HttpServer::Url() const {
  return fmt::format("http://{}:{}/{}/", kHost, impl_->port, impl_->options.token);
}

void HttpServer::Serve(const std::stop_token& stop) {
  constexpr std::chrono::milliseconds kStopCheck(20);
  auto listening = std::async(std::launch::async, [this] { impl_->server.listen_after_bind(); });
  bool stop_sent = false;
  while (listening.wait_for(kStopCheck) != std::future_status::ready) {
    // stop() has no effect on a server that does not run yet.
    if (!stop_sent && stop.stop_requested() && impl_->server.is_running()) {
      impl_->server.stop();
      stop_sent = true;
    }
  }
  listening.get();
}

std::string RandomToken() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw IoError("the system gives no random numbers, which the workbench needs for its address");
  }
  std::string token;
  for (const unsigned char byte : bytes) {
    token += fmt::format("{:02x}", byte);
  }
  return token;
}

}  // namespace semblance::problems
