// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the reader of InVesalius projects. A volume that is read is valid; any other input is an
// Error of this program.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "problems/io/volumes/invesalius.h"
#include "surfaces/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const int file = memfd_create("fuzz", 0);
  if (ftruncate(file, 0) != 0 || pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) {
    std::abort();
  }
  try {
    const std::string path = "/proc/self/fd/" + std::to_string(file);
    semblance::problems::CheckVolume(semblance::problems::ReadInvesalius(path), "fuzz");
  } catch (const semblance::problems::Error&) {
  }
  return 0;
}
