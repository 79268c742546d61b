// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the Python module `semblance`. Each adds its names; module.cc calls them all.
#pragma once

#include <pybind11/pybind11.h>

namespace semblance {

// HSpline: evaluate, project, edit, read and write.
void BindSurface(pybind11::module_& module);
// fit(): an H-spline through scattered points.
void BindFit(pybind11::module_& module);
// interpolate(): a depth per vertex from a few dowels.
void BindInterpolation(pybind11::module_& module);
// run() and study(): what the commands of these names do.
void BindExperiments(pybind11::module_& module);

}  // namespace semblance
