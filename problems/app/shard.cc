// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/shard.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <system_error>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Returns true if the whole `text` is "I/N".
bool ReadShard(const std::string& text, Shard& shard) {
  const char* const end = text.data() + text.size();
  const auto [slash, fault] = std::from_chars(text.data(), end, shard.index);
  if (fault != std::errc() || slash == end || *slash != '/') {
    return false;
  }
  const auto [rest, other_fault] = std::from_chars(slash + 1, end, shard.count);
  return other_fault == std::errc() && rest == end;
}

}  // namespace

Shard ParseShard(const std::string& text) {
  const char *index = std::getenv("SLURM_ARRAY_TASK_ID"),
             *count = std::getenv("SLURM_ARRAY_TASK_COUNT");
  const std::string given =
      text.empty() && index && count ? fmt::format("{}/{}", index, count) : text;
  Shard shard;
  if (!(given.empty() || ReadShard(given, shard)) || shard.count < 1 || shard.index < 0 ||
      shard.index >= shard.count) {
    throw InputError(fmt::format("--shard {}: write I/N with 0 <= I < N, e.g. 0/4", given));
  }
  return shard;
}

}  // namespace semblance::problems
