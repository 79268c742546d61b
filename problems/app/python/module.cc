// SPDX-License-Identifier: GPL-3.0-or-later
// The extension `semblance._semblance`. The classes and functions for users are the Python files of
// the package `semblance`, because these have signatures, documentation and pickling for free.
#include <string>
#include <string_view>

#include "interp/schemes/external_scheme.h"
#include "problems/app/python/bindings.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

// Raises an exception of semblance/errors.py.
void Raise(const char* type, const std::string& words) {
  const py::object found = py::module_::import("semblance.errors").attr(type);
  PyErr_SetString(found.ptr(), words.c_str());
}

// Maps the program's errors to those of semblance/errors.py.
void BindErrors() {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(thrown);
    } catch (const ConfigError& error) {
      const std::string words = error.what();
      const bool is_unknown = words.find(": unknown key") != words.npos;
      Raise(is_unknown ? "UnknownOptionError" : "ConfigError", words);
    } catch (const InputError& error) {
      Raise("InputError", error.what());
    } catch (const IoError& error) {
      Raise("IoError", error.what());
    } catch (const OutOfMemory& error) {
      PyErr_SetString(PyExc_MemoryError, error.what());
    } catch (const ExternalFailure& failure) {
      Raise("PluginError", std::string(failure.what()) + "\n\n" + failure.traceback());
    }
  });
}

}  // namespace
}  // namespace semblance::problems

PYBIND11_MODULE(_semblance, module) {
  module.attr("__version__") = SEMBLANCE_VERSION;
  semblance::problems::BindErrors();
  semblance::problems::BindSurface(module);
  semblance::problems::BindFit(module);
  semblance::problems::BindInterpolation(module);
  semblance::problems::BindExperiments(module);
}
