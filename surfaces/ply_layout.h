// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a PLY file is as long as its header says: OpenMesh's reader does not notice where a file
// was cut.
#pragma once

#include <string>
#include <string_view>

namespace semblance {

// Empty if `bytes` is a whole PLY file; else what is wrong with it, as the end of a sentence.
std::string PlyDefect(std::string_view bytes);

}  // namespace semblance
