// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the extension `semblance._semblance`, which the Python files of the package
// `semblance` use. Each adds its names; module.cc calls all of them.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <future>
#include <stop_token>

namespace semblance::problems {

// Surface: evaluate, project, edit, read and write.
void BindSurface(pybind11::module_& module);
// fit(): an H-spline through scattered points.
void BindFit(pybind11::module_& module);
// interpolate(): a depth per vertex from a few dowels.
void BindInterpolation(pybind11::module_& module);
// run() and study(), like the commands of these names.
void BindExperiments(pybind11::module_& module);

// Runs work(stop_token) in another thread and returns its result or throws its exception. The work
// runs without the interpreter's lock, so it must not touch Python. If the caller is Python's main
// thread and a signal raises an exception (Ctrl-C: KeyboardInterrupt), the work is requested to
// stop, and the exception is thrown after the work has ended.
template <class Work>
auto Interruptible(const Work& work) {
  namespace py = pybind11;
  constexpr auto kSignalCheck = std::chrono::milliseconds(50);
  std::stop_source stop;
  auto done = std::async(std::launch::async, work, stop.get_token());
  const auto is_ready = [&](auto wait) {
    const py::gil_scoped_release release;
    return done.wait_for(wait) == std::future_status::ready;
  };
  while (!is_ready(kSignalCheck)) {
    if (PyErr_CheckSignals() != 0) {
      const py::error_already_set interrupt;  // moves the exception out of the interpreter
      stop.request_stop();
      is_ready(std::chrono::hours(24 * 365));
      throw interrupt;
    }
  }
  return done.get();
}

}  // namespace semblance::problems
