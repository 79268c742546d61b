// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/program_end.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "problems/app/exit_code.h"
#include "problems/config/terminal_text.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance::problems {
namespace {

constexpr const char* kNoMemory =
    "not enough memory; lower implicit.resolution, or --jobs, or use smaller meshes";

// The first byte of the UTF-8 character that contains byte `at`.
std::size_t StartOfCharacter(std::string_view text, std::size_t at) {
  while (at > 0 && at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80) {
    --at;
  }
  return at;
}

std::string ShortLine(std::string_view line) {
  constexpr std::size_t kMaxLine_bytes = 1000, kBegin = 600, kEnd = 300;
  std::string text(line);
  if (line.size() > kMaxLine_bytes) {
    const std::size_t begin = StartOfCharacter(line, kBegin),
                      end = StartOfCharacter(line, line.size() - kEnd);
    text = fmt::format("{} [... {} bytes left out ...] {}", line.substr(0, begin), end - begin,
                       line.substr(end));
  }
  std::ranges::replace(text, '\n', '?');
  return ForTerminal(text);
}

std::string DescribeFileError(const std::filesystem::filesystem_error& error) {
  return error.path1().empty()
             ? fmt::format("a file cannot be used: {}", error.code().message())
             : fmt::format("{}: {}", error.path1().string(), error.code().message());
}

Failure Classify(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const OutOfMemory& e) {
    return {kNotUsable, e.what()};
  } catch (const Error& e) {
    return {kBadInput, e.what()};
  } catch (const Cancelled&) {
    return {kNotUsable, "stopped; no run was written, and the finished trials of a study are kept"};
  } catch (const std::filesystem::filesystem_error& e) {
    return {kBadInput, DescribeFileError(e)};
  } catch (const nlohmann::json::exception& e) {
    return {kBadInput, fmt::format("JSON that cannot be used: {}", JsonFault(e))};
  } catch (const std::bad_alloc&) {
    return {kNotUsable, kNoMemory};
  } catch (const std::length_error&) {
    return {kNotUsable, kNoMemory};
  } catch (const std::system_error& e) {
    return {kNotUsable, fmt::format("the system refused: {}", e.what())};
  } catch (const std::exception& e) {
    return {kNotUsable, fmt::format("the work failed: {}", e.what())};
  } catch (...) {
    return {kNotUsable, "the work failed for an unknown reason"};
  }
}

[[noreturn]] void ExitWithMessage(const char* message) {
  std::fprintf(stderr, "semblance: %s\n", message);
  std::_Exit(kNotUsable);
}

// ---------------------------------------------------------------------------------------------
// Signals
// ---------------------------------------------------------------------------------------------

constexpr unsigned kStopTimeout_s = 1;

std::stop_source& StopSource() {
  // A signal handler can reach it only as a static. It is never destroyed, because a signal may
  // arrive while the program ends.
  static std::stop_source& source = *new std::stop_source;
  return source;
}

// Uses only functions that are allowed in a signal handler.
void ExitAtOnce(int) {
  constexpr std::string_view kWords =
      "semblance: stopped; no run was written, and the finished trials of a study are kept\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kWords.data(), kWords.size());
  ::_exit(kNotUsable);
}

void RequestStop(int) {
  static volatile std::sig_atomic_t requested = 0;
  if (requested != 0) {
    ExitAtOnce(0);
  }
  requested = 1;
  // request_stop() may wait for a lock that the interrupted code holds, so the timer starts before
  // it.
  ::alarm(kStopTimeout_s);
  StopSource().request_stop();
}

void Handle(int signal, void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(signal, &action, nullptr);
}

bool IsIgnored(int signal) {
  struct sigaction action {};
  return ::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

}  // namespace

Failure DescribeFailure(const std::exception_ptr& thrown) {
  Failure failure = Classify(thrown);
  failure.words = Shortened(failure.words);
  return failure;
}

std::string Shortened(std::string_view message) {
  constexpr int kMaxLines = 50;
  std::string text;
  int lines = 0;
  for (bool more = true; more; ++lines) {
    const std::size_t end = std::min(message.find('\n'), message.size());
    if (lines < kMaxLines) {
      text += (lines > 0 ? "\n" : "") + ShortLine(message.substr(0, end));
    }
    more = end < message.size();
    message.remove_prefix(std::min(end + 1, message.size()));
  }
  return lines > kMaxLines ? fmt::format("{}\n... and {} lines more", text, lines - kMaxLines)
                           : text;
}

void TerminateWithMessage() noexcept {
  thread_local bool ending = false;
  if (std::exchange(ending, true)) {
    ExitWithMessage(kNoMemory);  // the code below threw, so the runtime called this function again
  }
  std::string words;  // stays empty if there is no memory for it
  try {
    if (const std::exception_ptr thrown = std::current_exception()) {
      words = DescribeFailure(thrown).words;
    } else {
      words = "internal error of the program; please report the command";
    }
  } catch (...) {
    words.clear();
  }
  ExitWithMessage(words.empty() ? kNoMemory : words.c_str());
}

std::stop_token StopOnSignals() {
  const std::stop_token token = StopSource().get_token();  // created before a handler can run
  Handle(SIGALRM, &ExitAtOnce);
  Handle(SIGTERM, &RequestStop);
  Handle(SIGXFSZ, SIG_IGN);  // a file beyond `ulimit -f` then fails like a full disk
  if (!IsIgnored(SIGINT)) {
    Handle(SIGINT, &RequestStop);
  }
  return token;
}

void RemoveStopTimeout() { ::alarm(0); }

}  // namespace semblance::problems
