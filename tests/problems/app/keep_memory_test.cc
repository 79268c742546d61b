// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/keep_memory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <vector>

namespace semblance::problems {
namespace {

long CountPageFaults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

// The page faults of a vector of 8 MB, 2,048 pages, that lives for a moment.
long FaultsOfAVector() {
  const long before = CountPageFaults();
  const std::vector<char> bytes(8 << 20, 'x');
  return bytes.back() == 'x' ? CountPageFaults() - before : -1;
}

TEST(KeepFreedMemory, ALaterStepUsesThePagesOfAnEarlierOne) {
#if !defined(__GLIBC__) || defined(SEMBLANCE_SANITIZED)
  GTEST_SKIP() << "another allocator";
#endif
  KeepFreedMemory();
  FaultsOfAVector();
  for (int step = 0; step < 3; ++step) {
    EXPECT_LT(FaultsOfAVector(), 200);
  }
}

}  // namespace
}  // namespace semblance::problems
