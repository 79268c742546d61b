// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/app/python/values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

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

// Copies the rows at once, because array and vectors both store kColumns doubles per row without
// gaps.
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
Doubles MakeTable(std::span<const Vector> rows) {
  constexpr py::ssize_t kColumns = Vector::RowsAtCompileTime;
  Doubles array({static_cast<py::ssize_t>(rows.size()), kColumns});
  if (!rows.empty()) {
    std::copy_n(rows.front().data(), kColumns * rows.size(), array.mutable_data());
  }
  return array;
}

// Quotes a text unless YAML can read it only as a plain word. Plain words must stay unquoted,
// because the readers of configurations refuse quotes around them.
std::string Quoted(const std::string& text) {
  static const std::set<std::string> kNotText = {"null", "true", "false", "yes", "no",
                                                 "on",   "off",  "nan",   "inf"};
  const bool word = !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0 &&
                    std::all_of(text.begin(), text.end(),
                                [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
  return word && !kNotText.contains(text) ? text : nlohmann::json(text).dump();
}

std::string ListText(const py::handle& list) {
  std::string text;
  for (const py::handle& entry : list) {
    text += (text.empty() ? "" : ", ") + OptionText(entry);
  }
  return "[" + text + "]";
}

std::string MapText(const py::dict& map) {
  std::string text;
  for (const auto& [key, value] : map) {
    text +=
        fmt::format("{}{}: {}", text.empty() ? "" : ", ", Quoted(py::str(key)), OptionText(value));
  }
  return "{" + text + "}";
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
    throw InputError(fmt::format("{} is {}; expected an array of n", name, DescribeShape(array)));
  }
  return {array.data(), static_cast<std::size_t>(array.shape(0))};
}

TriMesh MakeMesh(const Doubles& vertices, const Indices& triangles) {
  TriMesh mesh{.points = Points3(vertices, "vertices"), .triangles = {}};
  CheckColumns(triangles, 3, "triangles");
  const auto count = static_cast<std::int64_t>(mesh.points.size());
  for (py::ssize_t t = 0; t < triangles.shape(0); ++t) {
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

std::string OptionText(const py::handle& value) {
  if (value.is_none()) {
    return "null";
  }
  if (py::isinstance<py::bool_>(value)) {
    return value.cast<bool>() ? "true" : "false";
  }
  if (py::isinstance<py::float_>(value)) {
    return py::repr(py::float_(py::reinterpret_borrow<py::object>(value)));
  }
  if (py::hasattr(value, "__index__")) {  // NumPy's whole numbers too
    return py::str(py::int_(py::reinterpret_borrow<py::object>(value)));
  }
  if (py::isinstance<py::dict>(value)) {
    return MapText(py::reinterpret_borrow<py::dict>(value));
  }
  if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value)) {
    return ListText(value);
  }
  if (py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__")) {
    return Quoted(py::str(value));
  }
  throw InputError(fmt::format(
      "an option is a {}; expected a number, a text, True or False, None, a list or a dictionary",
      std::string(py::str(py::type::handle_of(value).attr("__name__")))));
}

}  // namespace semblance::problems
