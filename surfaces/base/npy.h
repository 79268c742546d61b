// SPDX-License-Identifier: GPL-3.0-or-later
// Arrays in NumPy's .npy files (numpy.lib.format, versions 1 to 3): numbers alone, no pickled
// objects.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

namespace semblance {

struct NpyArray {
  std::vector<std::size_t> shape;
  std::vector<double> values;  // as many as the product of shape, the last index fastest
};

// name: of the file, for messages. Little-endian whole numbers of 1, 2, 4 and 8 bytes and floating
// numbers of 4 and 8 bytes are read; whole numbers beyond 2^53 are rounded to doubles. Throws
// InputError "name: what" for what is no .npy file, another kind of number (pickled objects among
// them), a shape that does not fit the bytes that are there, or a value that is not finite.
NpyArray ParseNpy(std::string_view bytes, std::string_view name);

// Throws IoError if the file cannot be read, InputError as ParseNpy.
NpyArray ReadNpy(const std::filesystem::path& path);

}  // namespace semblance
