// SPDX-License-Identifier: GPL-3.0-or-later
// Keyword arguments as the configuration that they stand for, so that the same readers check them.
#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace semblance {

// YAML of numbers, strings, booleans, None, lists and dictionaries of such. Throws InputError for
// any other object.
std::string OptionText(const pybind11::handle& value);

}  // namespace semblance
