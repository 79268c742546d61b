// SPDX-License-Identifier: GPL-3.0-or-later
// The sources of the head into which a face is put at the end, and that head at rest, before it
// gets a subject's face.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "problems/face/bust/obj_text.h"
#include "problems/face/template_source.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// `ict` if the template is `ict`, else none.
struct AutoBust {
  static constexpr std::string_view kName = "auto";
};
template <class Visitor>
void Fields(Visitor&, AutoBust&) {}

struct NoBust {
  static constexpr std::string_view kName = "none";
};
template <class Visitor>
void Fields(Visitor&, NoBust&) {}

// The head of the ICT-FaceKit model, from configs/faces/ict.
struct IctBust {
  static constexpr std::string_view kName = "ict";
};
template <class Visitor>
void Fields(Visitor&, IctBust&) {}

// The head of the template, as `semblance template --bust` writes it.
struct HSplineBust {
  static constexpr std::string_view kName = "hspline";
  std::filesystem::path file;
};
template <class Visitor>
void Fields(Visitor& visit, HSplineBust& o) {
  visit(FieldInfo{.name = "file",
                  .doc = "file (.json) of the head that `semblance template --bust` writes with "
                         "the template"},
        o.file);
}

// Any head.
struct MeshBust {
  static constexpr std::string_view kName = "mesh";
  std::filesystem::path mesh;
  std::filesystem::path landmarks;
};
template <class Visitor>
void Fields(Visitor& visit, MeshBust& o) {
  visit(FieldInfo{.name = "mesh",
                  .doc = "a whole head in one piece, LPS in mm: OBJ (texture coordinates and "
                         "materials are kept), PLY, STL or OFF"},
        o.mesh);
  visit(FieldInfo{.name = "landmarks",
                  .doc = "points on its skin, in a form that `semblance template` reads: .csv with "
                         "site,x,y,z or i_multipie,x,y,z, or landmarks of a skull with depths"},
        o.landmarks);
}

using BustSource = std::variant<AutoBust, NoBust, IctBust, HSplineBust, MeshBust>;

struct BustModel {
  std::string name;
  TriMesh mesh;                       // mm, LPS, one piece
  std::vector<Sphere> eyeballs;       // in its frame; none: the mesh has its own
  std::optional<TemplateFace> rest;   // the generic face on the mesh; only if it has the same (u,v)
                                      // as the subject's face
  std::map<std::string, Vec3> sites;  // points of the mesh, by site code; used without `rest`
  std::optional<ObjText> obj;         // the file, if it was an OBJ
};

// The bust of `source` for this template; none if no bust is wanted. Throws IoError or InputError
// in one line for: a file that cannot be read; a mesh that is not one piece, holds two heads or is
// no head in mm; landmarks that are too few, mirrored or off the mesh (PrepareHead); a file of
// another template's head; materials and textures that cannot be used (ReadObjText).
std::optional<BustModel> LoadBust(const BustSource& source, const TemplateSource& face_template,
                                  const RunContext& context);

// The files that LoadBust reads, for the manifest.
std::vector<std::filesystem::path> BustFiles(const BustSource& source);

}  // namespace semblance::problems
