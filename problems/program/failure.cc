// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/program/failure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "problems/command_line/exit_code.h"
#include "problems/config/terminal_text.h"
#include "surfaces/base/error.h"
#include "surfaces/base/json_text.h"

namespace semblance {
namespace {

constexpr const char* kNoMemory =
    "not enough memory; lower implicit.resolution, or --jobs, or give smaller meshes";

// The start of the character of UTF-8 in which byte `at` lies.
std::size_t StartOfCharacter(std::string_view text, std::size_t at) {
  while (at > 0 && at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80) {
    --at;
  }
  return at;
}

std::string ShortLine(std::string_view line) {
  constexpr std::size_t kMost = 1000, kBegin = 600, kEnd = 300;
  std::string text(line);
  if (line.size() > kMost) {
    const std::size_t begin = StartOfCharacter(line, kBegin),
                      end = StartOfCharacter(line, line.size() - kEnd);
    text = fmt::format("{} [... {} bytes left out ...] {}", line.substr(0, begin), end - begin,
                       line.substr(end));
  }
  std::ranges::replace(text, '\n', '?');
  return ForTerminal(text);
}

std::string WordsOf(const std::filesystem::filesystem_error& error) {
  return error.path1().empty()
             ? fmt::format("a path: {}", error.code().message())
             : fmt::format("{}: {}", error.path1().string(), error.code().message());
}

Failure Describe(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const OutOfMemory& e) {
    return {kNotUsable, e.what()};
  } catch (const Error& e) {
    return {kBadInput, e.what()};
  } catch (const Cancelled&) {
    return {kNotUsable, "stopped; no run was written, and the finished trials of a study are kept"};
  } catch (const std::filesystem::filesystem_error& e) {
    return {kBadInput, WordsOf(e)};
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
    return {kNotUsable, "the work failed, and nothing says why"};
  }
}

}  // namespace

Failure FailureOf(const std::exception_ptr& thrown) {
  Failure failure = Describe(thrown);
  failure.words = Shortened(failure.words);
  return failure;
}

std::string Shortened(std::string_view message) {
  constexpr int kMostLines = 50;
  std::string text;
  int lines = 0;
  for (bool more = true; more; ++lines) {
    const std::size_t end = std::min(message.find('\n'), message.size());
    if (lines < kMostLines) {
      text += (lines > 0 ? "\n" : "") + ShortLine(message.substr(0, end));
    }
    more = end < message.size();
    message.remove_prefix(std::min(end + 1, message.size()));
  }
  return lines > kMostLines ? fmt::format("{}\n... and {} lines more", text, lines - kMostLines)
                            : text;
}

namespace {

[[noreturn]] void EndIn(const char* words) {
  std::fprintf(stderr, "semblance: %s\n", words);
  std::_Exit(kNotUsable);
}

}  // namespace

void EndInWords() noexcept {
  thread_local bool ending = false;
  if (std::exchange(ending, true)) {
    EndIn(kNoMemory);  // for an exception of what is below: the runtime calls this again
  }
  std::string words;  // none: not even memory for them
  try {
    if (const std::exception_ptr thrown = std::current_exception()) {
      words = FailureOf(thrown).words;
    } else {
      words = "a fault of the program itself; please report what you did";
    }
  } catch (...) {
    words.clear();
  }
  EndIn(words.empty() ? kNoMemory : words.c_str());
}

}  // namespace semblance
