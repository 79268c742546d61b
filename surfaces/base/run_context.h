// SPDX-License-Identifier: GPL-3.0-or-later
// Progress reports and cancellation for long steps.
#pragma once

#include <functional>
#include <limits>
#include <stop_token>
#include <string>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance::surfaces {

struct Event {
  std::string step;                                            // e.g. "polygonize"
  std::string message;                                         // one line for people, may be empty
  double fraction = std::numeric_limits<double>::quiet_NaN();  // done, 0..1; NaN if unknown
};

struct RunContext {
  std::function<void(const Event&)> on_event;  // may be empty; called from one thread at a time
  std::stop_token stop_token;
  int threads = 1;  // >= 1; no result depends on it

  void Report(std::string step, std::string message = {},
              double fraction = std::numeric_limits<double>::quiet_NaN()) const {
    if (on_event) {
      on_event({std::move(step), std::move(message), fraction});
    }
  }
  // Throws Cancelled if a stop was requested.
  void ThrowIfStopped() const {
    if (stop_token.stop_requested()) {
      throw Cancelled();
    }
  }
};

}  // namespace semblance::surfaces
