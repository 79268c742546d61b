// SPDX-License-Identifier: GPL-3.0-or-later
// Memory for arrays with an entry per voxel.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace semblance::problems {

// An allocator that asks for pages of 2 MB where an array is large and the system has them. An
// import allocates several arrays of a hundred million voxels, and their pages of 4 kB took a
// quarter of its time (docs/experiments/performance.md).
template <class T>
struct LargePages {
  using value_type = T;

  LargePages() = default;
  template <class U>
  LargePages(const LargePages<U>&) {}  // NOLINT: allocators convert into each other

  T* allocate(std::size_t count) {
    if (count > kMost / sizeof(T)) {
      throw std::bad_array_new_length();
    }
    const std::size_t bytes = count * sizeof(T);
    if (bytes < kLeast) {
      return static_cast<T*>(::operator new(bytes));
    }
    const std::size_t whole = (bytes + kPage - 1) / kPage * kPage;
    void* const memory = std::aligned_alloc(kPage, whole);
    if (memory == nullptr) {
      throw std::bad_alloc();
    }
    madvise(memory, whole, MADV_HUGEPAGE);  // a wish: without such pages small ones serve
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t count) {
    if (count * sizeof(T) < kLeast) {
      ::operator delete(memory);
    } else {
      std::free(memory);
    }
  }
  bool operator==(const LargePages&) const { return true; }

 private:
  static constexpr std::size_t kPage = std::size_t{2} << 20, kLeast = 2 * kPage,
                               kMost = PTRDIFF_MAX - 2 * kPage;
};

}  // namespace semblance::problems
