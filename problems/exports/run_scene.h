// SPDX-License-Identifier: GPL-3.0-or-later
// The folder of a run as one scene of glTF.
#pragma once

#include <filesystem>
#include <string>

namespace semblance {

// Binary glTF with the nodes `skull` (as scene.json has it: thinned out, for looking), `face`
// (face.ply with the colours of its values) and `dowels`, with a child `dowel SITE` for each:
// rods from bone to tip. In metres, +y up. Throws IoError if a file of the folder is missing or
// not that of a run.
std::string RunGlb(const std::filesystem::path& folder);

}  // namespace semblance
