// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/parallel.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <numeric>
#include <stdexcept>
#include <vector>

namespace semblance::surfaces {
namespace {

std::size_t SumOfIndices(int threads) {
  std::vector<std::size_t> values(1000);
  ParallelFor(values.size(), threads, 7, [&](std::size_t i) { values[i] = i; });
  return std::accumulate(values.begin(), values.end(), std::size_t{0});
}

// Runs the body in a child process, so that its memory limit does not affect the test.
template <class Body>
int CodeOfChild(const Body& body) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::_exit(body());
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(ParallelFor, DoesEachIndexOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 64}) {
    EXPECT_EQ(SumOfIndices(threads), 499500u) << threads;
  }
}

TEST(ParallelFor, WorksWithFewerThreadsThanRequested) {
  EXPECT_EQ(CodeOfChild([] {
              long pages = 0;
              std::ifstream("/proc/self/statm") >> pages;
              const rlim_t room = 40 << 20;  // a few stacks of 8 MB
              const rlim_t most = static_cast<rlim_t>(pages) * ::getpagesize() + room;
              const rlimit limit{.rlim_cur = most, .rlim_max = most};
              ::setrlimit(RLIMIT_AS, &limit);
              return SumOfIndices(64) == 499500 ? 0 : 1;
            }),
            0);
}

TEST(ParallelFor, RethrowsTheExceptionOfTheLowestBlock) {
  try {
    ParallelFor(100, 4, 1, [](std::size_t i) {
      if (i == 20 || i == 70) {
        throw std::runtime_error(std::to_string(i));
      }
    });
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "20");
  }
}

}  // namespace
}  // namespace semblance::surfaces
