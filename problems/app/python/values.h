// SPDX-License-Identifier: GPL-3.0-or-later
// Conversions between values of Python and of C++: NumPy's arrays.
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// Arguments of these types are copied to contiguous memory and converted to the number type if
// necessary; otherwise they use the caller's memory.
using Doubles = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;
using Indices =
    pybind11::array_t<std::int64_t, pybind11::array::c_style | pybind11::array::forcecast>;

// Arrays whose numbers may be NaN, and all others.
enum class MissingNumbers { kRefuse, kAllow };

// Convert arrays of n x 3, n x 2 and n numbers. Numbers() returns a view of the array. `name`: name
// of the array in messages. They throw InputError for another shape, and with the row for a number
// that is not finite.
std::vector<Vec3> Points3(const Doubles& array, std::string_view name);
std::vector<Vec2> Points2(const Doubles& array, std::string_view name);
std::span<const double> Numbers(const Doubles& array, std::string_view name,
                                MissingNumbers missing = MissingNumbers::kRefuse);

// Returns the number of threads or jobs; throws InputError if it is below 1.
int RequireAtLeastOne(int number, std::string_view name);

// vertices: n x 3. triangles: m x 3 indices from 0. Throws InputError for an index without vertex.
TriMesh MakeMesh(const Doubles& vertices, const Indices& triangles);
// m x 3 indices from 0, each below `count`. `name`: name of the array in messages.
std::vector<Triangle> ReadTriangles(const Indices& triangles, std::string_view name,
                                    std::size_t count);

Doubles MakeArray(std::span<const Vec3> points);
Doubles MakeArray(std::span<const Vec2> points);
Doubles MakeArray(std::span<const double> numbers);
Indices MakeArray(std::span<const Triangle> triangles);

}  // namespace semblance::problems
