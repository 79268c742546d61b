// SPDX-License-Identifier: GPL-3.0-or-later
// A template face as files, so that another generic face can take the place of the built-in one.
#pragma once

#include <filesystem>

#include "problems/face_template/template_face.h"

namespace semblance {

// Writes `path` (JSON: the (u,v) of the sites, the features, the name of the surface's file) and
// beside it the surface, as the stem of `path` with ".hspline.json". What is read back is equal to
// the bit. Throws IoError if a file cannot be written, InputError if the face is not one that
// ReadTemplate would accept.
void WriteTemplate(const std::filesystem::path& path, const TemplateFace& face);

// Throws IoError if a file cannot be read, InputError in one line that starts with `path` and says
// what is wrong: no JSON, an entry that is missing or of the wrong kind, one of the 32 sites
// missing, a (u,v) outside [0,1] x [0,1], a feature's vertex outside the surface's levels, a radius
// that is not positive. Sites beyond the 32 are kept.
TemplateFace ReadTemplate(const std::filesystem::path& path);

// The file of the surface that the template file `path` names. Throws IoError if `path` cannot be
// read, InputError if it is not a template file.
std::filesystem::path SurfaceFileOf(const std::filesystem::path& path);

}  // namespace semblance
