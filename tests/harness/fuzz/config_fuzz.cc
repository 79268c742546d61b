// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the reader of configurations. A configuration that is read can be written, and reads back
// to the same text; any other input is an Error of this program.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "problems/config/config.h"
#include "surfaces/base/error.h"
#include "tests/testing/config_samples.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using semblance::testing::Options;
  try {
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const auto read = semblance::problems::ReadConfigText<Options>(text, "/nowhere/fuzz.yaml");
    const std::string written = semblance::problems::WriteConfig(read);
    const auto again = semblance::problems::ReadConfigText<Options>(written, "/nowhere/fuzz.yaml");
    if (semblance::problems::WriteConfig(again) != written) {
      std::abort();
    }
  } catch (const semblance::problems::Error&) {
  }
  return 0;
}
