// SPDX-License-Identifier: GPL-3.0-or-later
// Long calls from Python, which Ctrl-C can end.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <future>
#include <stop_token>

namespace semblance {

// What work(stop_token) returns or throws. It runs in a thread of its own, without the
// interpreter's lock, so it must not touch Python. Where the caller is Python's main thread, a
// signal that Python raises for (Ctrl-C: KeyboardInterrupt) asks the work to stop, and is raised
// once it has.
template <class Work>
auto Interruptible(const Work& work) {
  namespace py = pybind11;
  constexpr auto kBetweenLooks = std::chrono::milliseconds(50);
  std::stop_source stop;
  auto done = std::async(std::launch::async, work, stop.get_token());
  const auto is_ready = [&](auto wait) {
    const py::gil_scoped_release release;
    return done.wait_for(wait) == std::future_status::ready;
  };
  while (!is_ready(kBetweenLooks)) {
    if (PyErr_CheckSignals() != 0) {
      const py::error_already_set interrupt;  // takes it from the interpreter
      stop.request_stop();
      is_ready(std::chrono::hours(24 * 365));
      throw interrupt;
    }
  }
  return done.get();
}

}  // namespace semblance
