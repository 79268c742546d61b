// SPDX-License-Identifier: GPL-3.0-or-later
// Between NumPy's arrays and ours.
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Made contiguous, and of doubles, where they are not; else the caller's own memory.
using Doubles = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;
using Indices =
    pybind11::array_t<std::int64_t, pybind11::array::c_style | pybind11::array::forcecast>;

// Views of n x 3, n x 2 and n arrays. `name`: what errors call the array. Throw InputError for
// another shape.
std::vector<Vec3> Points3(const Doubles& array, std::string_view name);
std::vector<Vec2> Points2(const Doubles& array, std::string_view name);
std::span<const double> Numbers(const Doubles& array, std::string_view name);

// Throws InputError for an index that names no vertex.
TriMesh MeshOf(const Doubles& vertices, const Indices& triangles);

Doubles ArrayOf(std::span<const Vec3> points);
Doubles ArrayOf(std::span<const Vec2> points);
Doubles ArrayOf(std::span<const double> numbers);
Indices ArrayOf(std::span<const Triangle> triangles);

}  // namespace semblance
