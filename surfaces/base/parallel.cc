// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

namespace semblance::surfaces {
namespace {

void RunBlock(std::size_t begin, std::size_t end, const std::function<void(std::size_t)>& body,
              std::exception_ptr& failure) {
  try {
    for (std::size_t i = begin; i < end; ++i) {
      body(i);
    }
  } catch (...) {
    failure = std::current_exception();
  }
}

}  // namespace

void ParallelFor(std::size_t count, int threads, std::size_t block,
                 const std::function<void(std::size_t)>& body) {
  block = std::max<std::size_t>(block, 1);
  const std::size_t blocks = (count + block - 1) / block;
  std::vector<std::exception_ptr> failures(blocks);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t b = next++; b < blocks; b = next++) {
      RunBlock(b * block, std::min(count, (b + 1) * block), body, failures[b]);
    }
  };
  {
    std::vector<std::jthread> helpers;
    const std::size_t wanted = std::min<std::size_t>(threads > 1 ? threads - 1 : 0, blocks);
    try {
      for (std::size_t t = 0; t < wanted; ++t) {
        helpers.emplace_back(work);
      }
    } catch (const std::system_error&) {
      // The system grants no more threads. The existing ones do the work.
    }
    work();
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) {
      std::rethrow_exception(failure);
    }
  }
}

}  // namespace semblance::surfaces
