// SPDX-License-Identifier: GPL-3.0-or-later
// A CT volume from an InVesalius project.
#pragma once

#include <filesystem>

#include "problems/volumes/ct_volume.h"

namespace semblance {

// Reads an InVesalius project (.inv3: a tar, gzipped or not, of `main.plist` and the matrix it
// names). The project has no origin: x and z begin at 0 with its first column and slice, y at 0
// with its last row, and go up to the left, upwards, and down to the front. Throws IoError if there
// is no such file, it is no such archive, or an entry is missing or of the wrong size; InputError
// for a type other than int16 or a shape or spacing that cannot be.
CtVolume ReadInvesalius(const std::filesystem::path& path);

}  // namespace semblance
