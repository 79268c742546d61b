// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a CT volume from an InVesalius project.
#pragma once

#include <filesystem>

#include "problems/io/volumes/ct_volume.h"

namespace semblance::problems {

// Reads an InVesalius project (.inv3: a tar, gzipped or not, of `main.plist` and the matrix that it
// names). The project has no origin, so the frame begins at the first column (x = 0, upwards to the
// left), the first slice (z = 0, upwards) and the last row (y = 0, downwards to the front). Throws
// IoError if there is no such file, it is not such an archive, or an entry is missing or has the
// wrong size. Throws InputError for a type other than int16, and for an impossible shape or
// spacing.
CtVolume ReadInvesalius(const std::filesystem::path& path);

}  // namespace semblance::problems
