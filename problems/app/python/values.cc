// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/python/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

namespace py = pybind11;

std::string DescribeShape(const py::array& array) {
  std::string shape;
  for (py::ssize_t k = 0; k < array.ndim(); ++k) {
    shape += fmt::format("{}{}", k == 0 ? "" : " x ", array.shape(k));
  }
  return array.ndim() == 0 ? "a single number" : shape;
}

void CheckColumns(const py::array& array, int columns, std::string_view name) {
  if (array.ndim() != 2 || array.shape(1) != columns) {
    throw InputError(
        fmt::format("{} is {}; expected an array of n x {}", name, DescribeShape(array), columns));
  }
}

// Throws InputError with the first row that has a number that is not finite.
void CheckRowsFinite(const Doubles& array, py::ssize_t columns, std::string_view name) {
  const double* const numbers = array.data();
  for (py::ssize_t k = 0; k < array.size(); ++k) {
    if (!std::isfinite(numbers[k])) {
      throw InputError(fmt::format("{}: row {} has {}, which is not finite; leave the row out",
                                   name, k / columns, numbers[k]));
    }
  }
}

// Copies the rows at once, because array and vectors both store kColumns doubles per row without
// gaps.
template <class Vector>
std::vector<Vector> Rows(const Doubles& array, std::string_view name) {
  constexpr int kColumns = Vector::RowsAtCompileTime;
  CheckColumns(array, kColumns, name);
  CheckRowsFinite(array, kColumns, name);
  std::vector<Vector> rows(array.shape(0));
  if (!rows.empty()) {
    std::copy_n(array.data(), kColumns * rows.size(), rows.front().data());
  }
  return rows;
}

template <class Vector>
Doubles MakeTable(std::span<const Vector> rows) {
  constexpr py::ssize_t kColumns = Vector::RowsAtCompileTime;
  Doubles array({static_cast<py::ssize_t>(rows.size()), kColumns});
  if (!rows.empty()) {
    std::copy_n(rows.front().data(), kColumns * rows.size(), array.mutable_data());
  }
  return array;
}

}  // namespace

std::vector<Vec3> Points3(const Doubles& array, std::string_view name) {
  return Rows<Vec3>(array, name);
}

std::vector<Vec2> Points2(const Doubles& array, std::string_view name) {
  return Rows<Vec2>(array, name);
}

std::span<const double> Numbers(const Doubles& array, std::string_view name,
                                MissingNumbers missing) {
  if (array.ndim() != 1) {
    throw InputError(fmt::format("{} is {}; expected an array of n", name, DescribeShape(array)));
  }
  if (missing == MissingNumbers::kRefuse) {
    CheckRowsFinite(array, 1, name);
  }
  return {array.data(), static_cast<std::size_t>(array.shape(0))};
}

std::vector<Triangle> ReadTriangles(const Indices& triangles, std::string_view name,
                                    std::size_t count) {
  CheckColumns(triangles, 3, name);
  std::vector<Triangle> rows;
  for (py::ssize_t t = 0; t < triangles.shape(0); ++t) {
    Triangle& triangle = rows.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const std::int64_t vertex = triangles.at(t, k);
      if (vertex < 0 || vertex >= static_cast<std::int64_t>(count)) {
        throw InputError(fmt::format("{}: row {} names {} {}; there are {}, from 0", name, t,
                                     name == "areas" ? "dowel" : "vertex", vertex, count));
      }
      triangle[k] = static_cast<std::int32_t>(vertex);
    }
  }
  return rows;
}

int RequireAtLeastOne(int number, std::string_view name) {
  if (number < 1) {
    throw InputError(fmt::format("{} is {}; it must be at least 1", name, number));
  }
  return number;
}

TriMesh MakeMesh(const Doubles& vertices, const Indices& triangles) {
  TriMesh mesh{.points = Points3(vertices, "vertices"), .triangles = {}};
  mesh.triangles = ReadTriangles(triangles, "triangles", mesh.points.size());
  return mesh;
}

Doubles MakeArray(std::span<const Vec3> points) { return MakeTable(points); }
Doubles MakeArray(std::span<const Vec2> points) { return MakeTable(points); }

Doubles MakeArray(std::span<const double> numbers) {
  Doubles array(static_cast<py::ssize_t>(numbers.size()));
  std::copy(numbers.begin(), numbers.end(), array.mutable_data());
  return array;
}

Indices MakeArray(std::span<const Triangle> triangles) {
  Indices array({static_cast<py::ssize_t>(triangles.size()), py::ssize_t{3}});
  std::int64_t* to = array.mutable_data();
  for (const Triangle& t : triangles) {
    to = std::copy(t.begin(), t.end(), to);
  }
  return array;
}

}  // namespace semblance::problems
