// SPDX-License-Identifier: GPL-3.0-or-later
// A head at rest, before it is given a subject's face.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "problems/bust/bust_source.h"
#include "problems/bust/obj_text.h"
#include "problems/face_template/template_source.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct BustModel {
  std::string name;
  TriMesh mesh;                       // mm, LPS, one piece
  std::vector<Sphere> eyeballs;       // in its frame; none: the mesh has its own
  std::optional<TemplateFace> rest;   // the generic face that lies on the mesh, where the
                                      // subject's face has the same (u,v)
  std::map<std::string, Vec3> sites;  // else: points of the mesh, by site code
  std::optional<ObjText> obj;         // the file, where it was an OBJ
};

// The bust that `source` comes to beside this template; none if there is to be none. Throws IoError
// or InputError in one line: a file that cannot be read, a mesh that is not one piece, holds two
// heads or is no head in mm, landmarks that are too few, mirrored or off the mesh (PrepareHead), a
// file of another template's head, materials and textures that cannot be used (ReadObjText).
std::optional<BustModel> LoadBust(const BustSource& source, const TemplateSource& face_template,
                                  const RunContext& context);

// What LoadBust reads, for the manifest.
std::vector<std::filesystem::path> BustFiles(const BustSource& source);

}  // namespace semblance
