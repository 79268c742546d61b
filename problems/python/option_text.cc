// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/python/option_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

namespace py = pybind11;

// A word that YAML takes for nothing but itself stands as it is, for the reader is strict about
// quotes; any other text is quoted.
std::string TextOf(const std::string& text) {
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
        fmt::format("{}{}: {}", text.empty() ? "" : ", ", TextOf(py::str(key)), OptionText(value));
  }
  return "{" + text + "}";
}

}  // namespace

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
    return TextOf(py::str(value));
  }
  throw InputError(fmt::format(
      "an option is a {}; expected a number, a text, True or False, None, a list or a dictionary",
      std::string(py::str(py::type::handle_of(value).attr("__name__")))));
}

}  // namespace semblance
