// SPDX-License-Identifier: GPL-3.0-or-later
// Functions of Python as schemes and metrics of a study. Each call holds the interpreter's lock, so
// that the threads of a study may call them; the calls of one process then take turns.
#pragma once

#include <pybind11/numpy.h>

#include <vector>

#include "problems/study/study_plugins.h"

namespace semblance::problems {

// Converts objects of the Python classes Scheme and Metric (semblance/plugins.py).
std::vector<NamedScheme> ReadSchemes(const pybind11::iterable& schemes);
std::vector<OwnMetric> ReadMetrics(const pybind11::iterable& metrics);

// The arrays of a result, by the names of semblance.Result: surface, the meshes as pairs of
// vertices and triangles, and numbers per vertex. None for what the result lacks.
pybind11::dict ResultArrays(const RunResult& result);
pybind11::dict ResultArrays(const DepthResult& result);

}  // namespace semblance::problems
