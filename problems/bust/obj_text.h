// SPDX-License-Identifier: GPL-3.0-or-later
// An OBJ file with all that it says of looks, so that it can be written again with other points.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct ObjMaterial {
  Vec3 colour = Vec3::Constant(0.8);  // Kd, 0..1
  std::filesystem::path texture;      // map_Kd; empty without
};

struct ObjCorner {
  std::int32_t point = -1;
  std::int32_t texture = -1;  // -1 without
};

struct ObjFace {
  std::vector<ObjCorner> corners;
  std::string material;  // empty before the first `usemtl`
};

struct ObjText {
  std::vector<std::string> lines;  // continued ones joined
  std::vector<Vec2> texture;       // as written: v upwards
  std::vector<ObjFace> faces;
  std::map<std::string, ObjMaterial> materials;
  std::string mtl;                              // the text of the material library; may be empty
  std::vector<std::filesystem::path> textures;  // the files that it names
};

// A file that ReadMesh has taken. Throws IoError for a material library or texture that cannot be
// read, InputError for one outside the folder of the OBJ, or a texture coordinate that is not
// there.
ObjText ReadObjText(const std::filesystem::path& path);

// The same lines with these points, without normals; `mtllib` names `library`, which is left out if
// empty. points: as many as the file has.
std::string ObjWithPoints(const ObjText& obj, const std::vector<Vec3>& points,
                          const std::string& library);

// The material library, whose textures lie beside it.
std::string FlatMtl(const ObjText& obj);

}  // namespace semblance
