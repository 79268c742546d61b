// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/least_squares/blas_threads.h"

#include <dlfcn.h>

namespace semblance {

void UseOneBlasThread() {
  static const bool done = [] {
    using SetThreads = void (*)(int);
    void* const symbol = dlsym(RTLD_DEFAULT, "openblas_set_num_threads");
    if (symbol != nullptr) {
      reinterpret_cast<SetThreads>(symbol)(1);
    }
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace semblance
