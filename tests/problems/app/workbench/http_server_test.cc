// SPDX-License-Identifier: GPL-3.0-or-later
// Attacks on the workbench's address, as raw bytes over a socket of the test.
#include "problems/app/workbench/http_server.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "problems/app/workbench/bench_api.h"
#include "problems/subject/phantom.h"
#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "tests/testing/scratch_folder.h"

namespace semblance::problems {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::ScratchFolder;
using ::testing::StartsWith;

// A connection to the server; the test waits at most a second for its bytes.
class Client {
 public:
  explicit Client(int port, const char* address = "127.0.0.1")
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, address, &to.sin_addr);
    const timeval patience{.tv_sec = 1, .tv_usec = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    is_connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // Returns false if the server has closed the connection.
  bool Send(const std::string& bytes) {
    return is_connected_ && ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
                                static_cast<ssize_t>(bytes.size());
  }

  // The bytes until the server closes the connection, or until it contains `end`.
  std::string Receive(const std::string& end = "") {
    std::string answer;
    char buffer[65536];
    for (ssize_t n = 0; is_connected_ && (end.empty() || answer.find(end) == answer.npos) &&
                        (n = ::recv(socket_, buffer, sizeof buffer, 0)) > 0;) {
      answer.append(buffer, static_cast<std::size_t>(n));
    }
    return answer;
  }

 private:
  int socket_;
  bool is_connected_ = false;
};

// The whole answer on one connection; empty if the connection is refused.
std::string Ask(int port, const std::string& bytes, const char* address = "127.0.0.1") {
  Client client(port, address);
  client.Send(bytes);
  return client.Receive();
}

double UsedMemory_mb() {
  double pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

// A workbench on a coarse phantom.
class WorkbenchServer : public ::testing::Test {
 protected:
  WorkbenchServer() : bench_(Options(folder_)), server_(Answering(), Listening()) {
    serving_ = std::jthread([this](const std::stop_token& stop) { server_.Serve(stop); });
  }

  static BenchOptions Options(const ScratchFolder& folder) {
    BenchOptions options;
    options.source = folder / "phantom.yaml";
    options.folder = folder / "bench";
    WriteFileAtomically(options.source,
                        fmt::format("base: {}/configs/phantom.yaml\nsubject: {{rings: 20}}\n",
                                    SEMBLANCE_SOURCE_DIR));
    return options;
  }

  AnswerPage Answering() {
    return [this](const PageRequest& request) { return Answer(bench_, request); };
  }

  static HttpServerOptions Listening() {
    HttpServerOptions options;
    options.max_upload_bytes = 1 << 20;
    options.max_body_bytes = 4096;
    options.limits.head_time = std::chrono::milliseconds(500);
    options.limits.max_waiting = 250;
    return options;
  }

  std::string Host() { return fmt::format("127.0.0.1:{}", server_.Port()); }
  std::string Token() {
    const std::string url = server_.Url();
    return url.substr(url.size() - 65, 64);
  }

  std::string Get(const std::string& path, const std::string& headers = "") {
    return Ask(server_.Port(), fmt::format("GET {} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{}"
                                           "\r\n",
                                           path, Host(), headers));
  }
  std::string GetBelow(const std::string& path) { return Get("/" + Token() + "/" + path); }

  std::string Post(const std::string& path, const std::string& body, const std::string& origin,
                   const std::string& more = "", const std::string& type = "application/json") {
    return Ask(server_.Port(),
               fmt::format("POST /{}/{} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{}{}"
                           "Content-Type: {}\r\nContent-Length: {}\r\n\r\n{}",
                           Token(), path, Host(), origin, more, type, body.size(), body));
  }
  std::string OwnOrigin() { return fmt::format("Origin: http://{}\r\n", Host()); }

  ScratchFolder folder_;
  Bench bench_;
  HttpServer server_;
  std::jthread serving_;
};

TEST_F(WorkbenchServer, RepliesAreNotCompressed) {
  const std::string path = "/" + Token() + "/api/schema";
  const auto body = [](const std::string& answer) {
    return answer.substr(answer.find("\r\n\r\n"));
  };
  const std::string answer = Get(path, "Accept-Encoding: gzip, deflate, br\r\n");
  EXPECT_THAT(answer, AllOf(StartsWith("HTTP/1.1 200"), Not(HasSubstr("Content-Encoding"))));
  EXPECT_EQ(body(answer), body(Get(path)));
  EXPECT_GT(answer.size(), 10000U);
}

TEST_F(WorkbenchServer, ThePageAndItsStateNeedTheToken) {
  EXPECT_THAT(GetBelow(""), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("<!DOCTYPE html>"),
                                  HasSubstr("Content-Security-Policy: default-src 'none'"),
                                  HasSubstr("Referrer-Policy: no-referrer")));
  EXPECT_THAT(GetBelow("api/state"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("\"landmarks\"")));
  EXPECT_THAT(Post("api/act", R"({"do": "set", "path": "title", "value": "mine"})", OwnOrigin()),
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("\"mine\"")));
}

TEST_F(WorkbenchServer, RequestsWithoutTheWholeTokenAreRefused) {
  std::string near = Token();
  near.back() = near.back() == '0' ? '1' : '0';
  for (const std::string& path : std::vector<std::string>{
           "/", "/index.html", "/api/state", "/" + near + "/api/state",
           "/" + Token().substr(0, 63) + "/api/state", "/" + Token() + "0/api/state", "//api/state",
           "/" + Token(), "/x/" + Token() + "/api/state"}) {
    EXPECT_THAT(Get(path), AllOf(StartsWith("HTTP/1.1 403"), Not(HasSubstr("landmarks")))) << path;
  }
}

TEST_F(WorkbenchServer, EachServerHasItsOwnToken) {
  EXPECT_EQ(RandomToken().size(), 64u);
  EXPECT_NE(RandomToken(), RandomToken());
}

TEST_F(WorkbenchServer, AnotherHostIsRefused) {
  for (const std::string& host : {std::string("evil.example"), std::string("127.0.0.1"),
                                  fmt::format("127.0.0.1.evil.example:{}", server_.Port()),
                                  std::string("127.0.0.1:1"), std::string()}) {
    EXPECT_THAT(Ask(server_.Port(), fmt::format("GET /{}/api/state HTTP/1.1\r\nHost: {}\r\n"
                                                "Connection: close\r\n\r\n",
                                                Token(), host)),
                AllOf(StartsWith("HTTP/1.1 403"), HasSubstr("host")))
        << host;
  }
  EXPECT_THAT(Get("/" + Token() + "/api/state", "Host: evil.example\r\n"),
              StartsWith("HTTP/1.1 403"));
}

TEST_F(WorkbenchServer, AnotherOriginAndAPostWithoutOriginAreRefused) {
  const std::string body = R"({"do": "set", "path": "title", "value": "theirs"})";
  for (const std::string& origin :
       {std::string(), std::string("Origin: null\r\n"), std::string("Origin: http://evil\r\n"),
        fmt::format("Origin: https://{}\r\n", Host()), std::string("Origin: http://127.0.0.1\r\n"),
        fmt::format("Origin: http://{}.evil\r\n", Host())}) {
    EXPECT_THAT(Post("api/act", body, origin), StartsWith("HTTP/1.1 403")) << origin;
  }
  EXPECT_THAT(Get("/" + Token() + "/api/state", "Origin: http://evil\r\n"),
              StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(GetBelow("api/state"), Not(HasSubstr("theirs")));
}

TEST_F(WorkbenchServer, LargeBodiesAndBodiesOfUnknownSizeAreRefusedUnread) {
  const std::string head = fmt::format(
      "POST /{}/api/act HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{}"
      "Content-Type: application/json\r\n",
      Token(), Host(), OwnOrigin());
  EXPECT_THAT(Ask(server_.Port(), head + "Content-Length: 99999999999999\r\n\r\n{"),
              StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(Ask(server_.Port(), head + "Content-Length: 5000\r\n\r\n{"),
              StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(Ask(server_.Port(), head + "Content-Length: -1\r\n\r\n{"),
              StartsWith("HTTP/1.1 411"));
  EXPECT_THAT(Ask(server_.Port(), head + "Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n"),
              StartsWith("HTTP/1.1 411"));
  EXPECT_THAT(Post("api/act", "a=1", OwnOrigin(), "", "application/x-www-form-urlencoded"),
              StartsWith("HTTP/1.1 415"));
}

TEST_F(WorkbenchServer, NoPathLeadsOutOfTheRun) {
  WriteFileAtomically(folder_ / "secret.txt", "secret");
  std::filesystem::create_directories(folder_ / "bench/run");
  std::filesystem::create_symlink(folder_ / "secret.txt", folder_ / "bench/run/link");
  for (const char* path :
       {"run/../config.yaml", "run/../../secret.txt", "run/%2e%2e/%2e%2e/secret.txt",
        "run/..%2f..%2fsecret.txt", "run//etc/passwd", "run/link", "../secret.txt", "/etc/passwd",
        "run/", "run/.", "run/..\\..\\secret.txt"}) {
    EXPECT_THAT(GetBelow(path), AllOf(StartsWith("HTTP/1.1 404"), Not(HasSubstr("root:")),
                                      Not(HasSubstr("secret\r")), Not(HasSubstr("subject:"))))
        << path;
  }
}

TEST_F(WorkbenchServer, GarbageGetsAnErrorMessage) {
  for (const char* body :
       {"", "{", "[]", "null", "\"do\"", "{}", R"({"do": 3})", R"({"do": "nothing"})",
        R"({"do": "place"})", R"({"do": "open"})", R"({"do": "variants"})",
        R"({"do": "place", "site": "g", "origin": [1, 2], "near": 1})",
        R"({"do": "set", "path": "tissue.set_mm.g", "value": 1e999})", "{\"do\": \"\xff\xfe\"}"}) {
    EXPECT_THAT(Post("api/act", body, OwnOrigin()),
                AllOf(StartsWith("HTTP/1.1 400"), HasSubstr("\"error\"")))
        << body;
  }
  const std::string deep(2000, '[');
  EXPECT_THAT(Post("api/act", deep, OwnOrigin()), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(Ask(server_.Port(), "garbage\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  for (const char* path : {"api/look", "api/pull"}) {
    EXPECT_THAT(Post(path, "{}", OwnOrigin()), StartsWith("HTTP/1.1 400")) << path;
  }
  EXPECT_THAT(GetBelow("api/state"), StartsWith("HTTP/1.1 200")) << "and it goes on";
}

// A browser would list a status of 400 and above in its console as a fault of the page.
TEST_F(WorkbenchServer, AnImpossibleActionGetsStatus200WithTheReason) {
  const auto refused = AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("{\"refused\":"),
                             Not(HasSubstr("Content-Disposition")));
  const std::string before = GetBelow("api/state");
  for (
      const char* body :
      {R"({"do": "open", "path": "/", "as": "king"})",
       R"({"do": "open", "path": "/", "as": "head", "volume": {"bone_hu": "hard"}})",
       R"({"do": "variants", "variants": ["thick"]})",
       R"({"do": "set", "path": "no.such", "value": 1})",
       R"({"do": "set", "path": "subject", "value": {"type": "phantom"}})",
       R"({"do": "pull", "at": [0,0,0], "by": [1,0,0], "level": 1, "reach": 2, "mirror": true})"}) {
    EXPECT_THAT(Post("api/act", body, OwnOrigin()), refused) << body;
  }
  for (const char* path : {"api/coarse?variant=thick", "api/variant?variant=obese", "api/export",
                           "api/landmarks?format=.exe"}) {
    EXPECT_THAT(GetBelow(path), refused) << path;
  }
  EXPECT_THAT(Post("api/look", R"({"path": "/no/such"})", OwnOrigin()),
              AllOf(refused, HasSubstr("no such file")));
  EXPECT_EQ(GetBelow("api/state"), before);
}

TEST_F(WorkbenchServer, AnUploadCannotEscapeItsBatch) {
  const auto upload = [this](const std::string& query) {
    return Post("api/upload?" + query, "not a mesh", OwnOrigin(), "", "application/octet-stream");
  };
  for (const char* name :
       {"..%2f..%2fa.ply", "%2fetc%2fa.ply", ".ply", "a%00.ply", "a%0a.ply", ""}) {
    EXPECT_THAT(upload(std::string("batch=b&name=") + name), HasSubstr("{\"refused\":")) << name;
  }
  for (const char* batch : {"..", "%2e%2e", "a%2fb", "", "%2f"}) {
    EXPECT_THAT(upload(fmt::format("batch={}&name=a.ply", batch)), HasSubstr("{\"refused\":"))
        << batch;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.ply"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "bench/a.ply"));
  EXPECT_THAT(upload("batch=b&name=a.ply"),
              AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("{\"path\":")));
  EXPECT_THAT(GetBelow("api/state"), Not(HasSubstr("a.ply"))) << "an upload is not opened yet";
  EXPECT_THAT(Post("api/act", R"({"do": "forget", "batch": ".."})", OwnOrigin()),
              HasSubstr("{\"refused\":"));
  EXPECT_THAT(Post("api/act", R"({"do": "forget", "batch": "b"})", OwnOrigin()),
              AllOf(StartsWith("HTTP/1.1 200"), Not(HasSubstr("refused"))));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "bench/incoming/b"));
}

TEST_F(WorkbenchServer, ASecondWorkbenchOnTheFolderIsRefused) {
  BenchOptions options;
  options.folder = folder_ / "bench";
  try {
    const Bench second(options);
    FAIL() << "two on one folder";
  } catch (const IoError& error) {
    EXPECT_THAT(error.what(), HasSubstr("another process"));
  }
}

TEST_F(WorkbenchServer, AStopDuringTheStartEndsTheServer) {
  for (int k = 0; k < 40; ++k) {
    HttpServer server(Answering(), Listening());
    const std::jthread serving([&](const std::stop_token& stop) { server.Serve(stop); });
    std::this_thread::sleep_for(std::chrono::microseconds(10 * k));
  }  // each thread is stopped and joined here
}

TEST(HttpServer, AReplyThatHasBegunArrivesWholeWhenTheServerIsStopped) {
  const std::string body(64 << 20, 'x');  // more than the buffers of a connection hold
  std::stop_source stop;
  HttpServer server([&](const PageRequest&) { return PageReply{200, "text/plain", body, {}}; }, {});
  std::jthread serving([&] { server.Serve(stop.get_token()); });
  Client client(server.Port());
  client.Send(fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n\r\n",
                          server.Url().substr(server.Url().rfind('/', server.Url().size() - 2)),
                          server.Port()));
  std::string reply = client.Receive("\r\n\r\nx");
  stop.request_stop();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // the server notices the stop
  reply += client.Receive();
  EXPECT_EQ(reply.size() - reply.find("\r\n\r\n") - 4, body.size());
}

TEST(HttpHead, IsReadToItsEndWithTheSizeOfTheBody) {
  const auto read = [](const std::string& text) { return ReadHead(text, {}); };
  const std::string get = "GET /a HTTP/1.1\r\nHost: x\r\n\r\n";
  EXPECT_EQ(read(get + "more").size, get.size());
  EXPECT_EQ(read(get).body, 0u);
  for (std::size_t bytes = 0; bytes < get.size(); ++bytes) {
    EXPECT_EQ(read(get.substr(0, bytes)).size, 0u) << bytes;
    EXPECT_EQ(read(get.substr(0, bytes)).fault, 0) << bytes;
  }
  const auto body = [&](const std::string& headers) {
    return read("POST / HTTP/1.1\r\n" + headers + "\r\n\r\n").body;
  };
  EXPECT_EQ(body("content-length:  17 "), 17u);
  EXPECT_EQ(body("Content-Length: -1"), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(body("Content-Length: 1e3"), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(body("Transfer-Encoding: chunked"), std::numeric_limits<std::uint64_t>::max());
}

TEST(HttpHead, IsRefusedBeyondItsLimitsAndIfTwoReadersCouldDiffer) {
  const auto fault = [](const std::string& text) { return ReadHead(text, {}).fault; };
  const auto with = [&](const std::string& headers) {
    return fault("POST / HTTP/1.1\r\nHost: x\r\n" + headers + "\r\n");
  };
  EXPECT_EQ(fault("GET /" + std::string(8192, 'a')), 431);
  EXPECT_EQ(fault("GET / HTTP/1.1\r\nA: " + std::string(8192, 'a') + "\r\n\r\n"), 431);
  std::string lines;
  for (int k = 0; k < 98; ++k) {
    lines += "A: b\r\n";
  }
  EXPECT_EQ(with(lines), 0);
  EXPECT_EQ(with(lines + "A: b\r\n"), 431);
  for (const char* wrong :
       {"Content-Length: 1\r\nContent-Length: 2\r\n", "Content-Length: 1\r\ncontent-length: 1\r\n",
        "Content-Length: 1\r\nTransfer-Encoding: chunked\r\n", "Content-Length : 1\r\n",
        " folded: 1\r\n", "A: b\r\n folded\r\n", "no header\r\n", ": 1\r\n", "A: b\nB: c\r\n",
        "A: b\rB: c\r\n", "A: \x01\r\n", "A\x7f: b\r\n", "Range: bytes=0-1\r\n"}) {
    EXPECT_EQ(with(wrong), 400) << wrong;
  }
  EXPECT_EQ(with(std::string("A: b\0c\r\n", 8)), 400);
  EXPECT_EQ(fault("GET / HTTP/1.1\n\n"), 400) << "at once, not after the time of a head";
}

TEST_F(WorkbenchServer, ARequestWithTwoMeaningsIsRefused) {
  const std::string head =
      fmt::format("POST /{}/api/act HTTP/1.1\r\nHost: {}\r\n{}Content-Type: application/json\r\n",
                  Token(), Host(), OwnOrigin());
  for (const char* lengths :
       {"Content-Length: 2\r\nContent-Length: 4\r\n", "Content-Length: 2\r\nContent-Length: 2\r\n",
        "Content-Length: 2\r\nTransfer-Encoding: chunked\r\n"}) {
    EXPECT_THAT(Ask(server_.Port(), head + lengths + "\r\n{}{}"),
                AllOf(StartsWith("HTTP/1.1 400"), HasSubstr("Content-Length")))
        << lengths;
  }
  // A body that is not read is no next request.
  const std::string inner =
      fmt::format("GET /{}/api/state HTTP/1.1\r\nHost: {}\r\n\r\n", Token(), Host());
  for (const std::string& outer :
       {fmt::format("GET /{}/api/sites HTTP/1.1\r\nHost: {}\r\nContent-Length: {}\r\n\r\n", Token(),
                    Host(), inner.size()),
        fmt::format("GET /{}/api/sites HTTP/1.1\r\nHost: {}\r\nTransfer-Encoding: chunked\r\n\r\n",
                    Token(), Host())}) {
    EXPECT_THAT(Ask(server_.Port(), outer + inner), Not(HasSubstr("\"landmarks\""))) << outer;
  }
}

TEST_F(WorkbenchServer, NoControlCharacterInAnAddressIsAccepted) {
  std::filesystem::create_directories(folder_ / "bench/run");
  WriteFileAtomically(folder_ / "bench/run/a.txt", "text");
  EXPECT_THAT(GetBelow("run/a.txt"), StartsWith("HTTP/1.1 200"));
  for (const char* path : {"run/a.txt%00.png", "run/a.txt%00", "run/a.txt%0a", "run/a.txt%0D%0Ab",
                           "run/a.txt%7f", "run/a.txt%u0000.png", "%00"}) {
    EXPECT_THAT(GetBelow(path), StartsWith("HTTP/1.1 400")) << path;
  }
  EXPECT_THAT(Post("api/look", R"({"path": "/a.ply\u0000.png"})", OwnOrigin()),
              HasSubstr("the character NUL"));
}

TEST_F(WorkbenchServer, RequestsFollowEachOtherOnAConnection) {
  const std::string request =
      fmt::format("GET /{}/api/sites HTTP/1.1\r\nHost: {}\r\n\r\n", Token(), Host());
  const std::string post = fmt::format(
      "POST /{}/api/act HTTP/1.1\r\nHost: {}\r\n{}Content-Type: application/json\r\n"
      "Content-Length: {}\r\n\r\n",
      Token(), Host(), OwnOrigin(), 48);
  const std::string body = R"({"do": "set", "path": "title", "value": "third"})";
  ASSERT_EQ(body.size(), 48u);
  Client client(server_.Port());
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(client.Send(request));
    EXPECT_THAT(client.Receive("]"), StartsWith("HTTP/1.1 200"));
  }
  Client pipelined(server_.Port());  // all at once, and the last body in two parts
  ASSERT_TRUE(pipelined.Send(request + post + body.substr(0, 20)));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_TRUE(pipelined.Send(body.substr(20)));
  EXPECT_THAT(pipelined.Receive("third"), HasSubstr("third"));
}

// Other people of the machine need no token to connect.
TEST_F(WorkbenchServer, EndlessHeadsTakeNoMemory) {
  const std::string mega(1 << 20, 'a');
  std::string headers;
  while (headers.size() < mega.size()) {
    headers += fmt::format("A{}: b\r\n", headers.size());
  }
  const double before = UsedMemory_mb();
  for (const auto& [start, more] :
       {std::pair("GET /", mega), std::pair("GET / HTTP/1.1\r\nA: ", mega),
        std::pair("GET / HTTP/1.1\r\n", headers)}) {
    Client client(server_.Port());
    client.Send(start);
    int sent_mb = 0;
    while (sent_mb < 50 && client.Send(more)) {
      ++sent_mb;
    }
    EXPECT_LT(sent_mb, 50) << start;
  }
  EXPECT_LT(UsedMemory_mb() - before, 20);
}

TEST_F(WorkbenchServer, SlowClientsKeepNobodyWaitingAndAreClosed) {
  std::vector<std::unique_ptr<Client>> slow;
  const std::string post =
      fmt::format("POST /{}/api/act HTTP/1.1\r\nHost: {}\r\n", Token(), Host());
  for (int k = 0; k < 200; ++k) {
    slow.push_back(std::make_unique<Client>(server_.Port()));
    EXPECT_TRUE(slow.back()->Send(k % 2 == 0 ? "G" : post));
  }
  for (int k = 0; k < 5; ++k) {
    for (const auto& client : slow) {
      client->Send(k == 0 ? "E" : "x");
    }
    const auto start = std::chrono::steady_clock::now();
    EXPECT_THAT(GetBelow("api/state"), StartsWith("HTTP/1.1 200"));
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1));
  }
  // Listening() allows a head half a second.
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  for (const auto& client : slow) {
    EXPECT_THAT(client->Receive(), AnyOf(StartsWith("HTTP/1.1 408"), StartsWith("HTTP/1.1 400")));
  }
}

TEST_F(WorkbenchServer, AFloodOfConnectionsClosesTheOldestOnes) {
  std::vector<std::unique_ptr<Client>> flood;
  for (int k = 0; k < 400; ++k) {  // Listening() allows 250
    flood.push_back(std::make_unique<Client>(server_.Port()));
  }
  EXPECT_THAT(GetBelow("api/state"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(flood.front()->Receive(), "");
}

TEST_F(WorkbenchServer, OnlyOneLoopbackAddressAnswers) {
  // Every address of 127/8 is this machine. The server listens on only one of them.
  EXPECT_EQ(Ask(server_.Port(), "GET / HTTP/1.1\r\n\r\n", "127.0.0.2"), "");
}

}  // namespace
}  // namespace semblance::problems
