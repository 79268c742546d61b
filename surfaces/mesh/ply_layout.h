// SPDX-License-Identifier: GPL-3.0-or-later
// What OpenMesh's reader leaves out of a PLY file: whether it is as long as its header says, and
// the values a vertex may carry beside its place.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace semblance {

// Empty if `bytes` is a whole PLY file; else what is wrong with it, as the end of a sentence.
std::string PlyDefect(std::string_view bytes);

// The property `name` of every vertex, in order, of whatever number type. Throws IoError, beginning
// with `where`, if the file is not whole; InputError if it has no vertices first, or they have no
// such property.
std::vector<double> PlyVertexScalar(std::string_view bytes, const std::string& name,
                                    const std::string& where);

}  // namespace semblance
