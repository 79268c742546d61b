// SPDX-License-Identifier: GPL-3.0-or-later
// Reads arrays of numbers from NumPy's .npy files (numpy.lib.format, versions 1 to 3).
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

#include "surfaces/base/layers.h"

namespace semblance::surfaces {

struct NpyArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;  // last index fastest; the count is the product of shape
};

// Reads little-endian integers of 1, 2, 4 and 8 bytes and floating-point numbers of 4 and 8 bytes.
// Integers beyond 2^53 are rounded to doubles. name: the file's name, for messages. Throws
// InputError "name: fault" for bytes that are not a .npy file, other types (also pickled objects),
// a shape that does not fit the size of the data, or a value that is not finite.
NpyArray ParseNpy(std::string_view bytes, std::string_view name);

// Throws IoError if the file cannot be read, and InputError as ParseNpy does.
NpyArray ReadNpy(const std::filesystem::path& path);

}  // namespace semblance::surfaces
