// SPDX-License-Identifier: GPL-3.0-or-later
// For LD_PRELOAD: a clock of the day that somebody sets all the time, by up to ten years either
// way.
#include <dlfcn.h>
#include <sys/time.h>

#include <atomic>
#include <cstdint>
#include <ctime>

namespace {

std::int64_t NextJump_s() {
  static std::atomic<std::uint64_t> state{1};
  constexpr std::int64_t kTenYears_s = 315'000'000;
  const std::uint64_t drawn = state.fetch_add(1) * 6364136223846793005ULL;
  return static_cast<std::int64_t>((drawn >> 33) % (2 * kTenYears_s)) - kTenYears_s;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) {
  using Function = int (*)(clockid_t, timespec*);
  static const auto real = reinterpret_cast<Function>(::dlsym(RTLD_NEXT, "clock_gettime"));
  const int code = real(clock, time);
  if (clock == CLOCK_REALTIME) {
    time->tv_sec += NextJump_s();
  }
  return code;
}

extern "C" std::time_t time(std::time_t* out) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) {
    *out = now.tv_sec;
  }
  return now.tv_sec;
}

extern "C" int gettimeofday(timeval* out, void*) {
  timespec now{};
  const int code = clock_gettime(CLOCK_REALTIME, &now);
  *out = {now.tv_sec, now.tv_nsec / 1000};
  return code;
}
