// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/python/arrays.h"

#include <fmt/format.h>

#include <algorithm>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

std::string ShapeOf(const pybind11::array& array) {
  std::string shape;
  for (pybind11::ssize_t k = 0; k < array.ndim(); ++k) {
    shape += fmt::format("{}{}", k == 0 ? "" : " x ", array.shape(k));
  }
  return array.ndim() == 0 ? "a single number" : shape;
}

void CheckColumns(const pybind11::array& array, int columns, std::string_view name) {
  if (array.ndim() != 2 || array.shape(1) != columns) {
    throw InputError(
        fmt::format("{} is {}; expected an array of n x {}", name, ShapeOf(array), columns));
  }
}

// Both are `Columns` doubles a row, without gaps.
template <class Vector>
std::vector<Vector> Rows(const Doubles& array, std::string_view name) {
  constexpr int kColumns = Vector::RowsAtCompileTime;
  CheckColumns(array, kColumns, name);
  std::vector<Vector> rows(array.shape(0));
  if (!rows.empty()) {
    std::copy_n(array.data(), kColumns * rows.size(), rows.front().data());
  }
  return rows;
}

template <class Vector>
Doubles TableOf(std::span<const Vector> rows) {
  constexpr pybind11::ssize_t kColumns = Vector::RowsAtCompileTime;
  Doubles array({static_cast<pybind11::ssize_t>(rows.size()), kColumns});
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

std::span<const double> Numbers(const Doubles& array, std::string_view name) {
  if (array.ndim() != 1) {
    throw InputError(fmt::format("{} is {}; expected an array of n", name, ShapeOf(array)));
  }
  return {array.data(), static_cast<std::size_t>(array.shape(0))};
}

TriMesh MeshOf(const Doubles& vertices, const Indices& triangles) {
  TriMesh mesh{.points = Points3(vertices, "vertices"), .triangles = {}};
  CheckColumns(triangles, 3, "triangles");
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  for (pybind11::ssize_t t = 0; t < triangles.shape(0); ++t) {
    Triangle& triangle = mesh.triangles.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const std::int64_t vertex = triangles.at(t, k);
      if (vertex < 0 || vertex >= count) {
        throw InputError(fmt::format("triangles: row {} names vertex {}; there are {}, from 0", t,
                                     vertex, count));
      }
      triangle[k] = static_cast<std::int32_t>(vertex);
    }
  }
  return mesh;
}

Doubles ArrayOf(std::span<const Vec3> points) { return TableOf(points); }
Doubles ArrayOf(std::span<const Vec2> points) { return TableOf(points); }

Doubles ArrayOf(std::span<const double> numbers) {
  Doubles array(static_cast<pybind11::ssize_t>(numbers.size()));
  std::copy(numbers.begin(), numbers.end(), array.mutable_data());
  return array;
}

Indices ArrayOf(std::span<const Triangle> triangles) {
  Indices array({static_cast<pybind11::ssize_t>(triangles.size()), pybind11::ssize_t{3}});
  std::int64_t* to = array.mutable_data();
  for (const Triangle& t : triangles) {
    to = std::copy(t.begin(), t.end(), to);
  }
  return array;
}

}  // namespace semblance
