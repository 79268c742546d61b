// SPDX-License-Identifier: GPL-3.0-or-later
// The Python module `semblance`.
#include "problems/app/python/bindings.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

// Maps the program's errors to Python's. ConfigError and InputError report values that cannot be
// used, IoError reports files that cannot be used.
void BindErrors(pybind11::module_& module) {
  pybind11::register_exception<InputError>(module, "InputError", PyExc_ValueError);
  pybind11::register_exception<ConfigError>(module, "ConfigError", PyExc_ValueError);
  pybind11::register_exception<IoError>(module, "IoError", PyExc_OSError);
}

}  // namespace
}  // namespace semblance::problems

PYBIND11_MODULE(semblance, module) {
  module.doc() =
      "Faces from skulls: H-splines, fits of scattered points, depths between depth markers, "
      "experiments and studies. Lengths are in mm. Arrays are NumPy arrays of doubles.";
  module.attr("__version__") = SEMBLANCE_VERSION;
  semblance::problems::BindErrors(module);
  semblance::problems::BindSurface(module);
  semblance::problems::BindFit(module);
  semblance::problems::BindInterpolation(module);
  semblance::problems::BindExperiments(module);
}
