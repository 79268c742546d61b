// SPDX-License-Identifier: GPL-3.0-or-later
// An OBJ file with its materials and textures, so that it can be written again with other points.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh_files/read_obj.h"

namespace semblance::problems {

struct ObjMaterial {
  Vec3 colour = Vec3::Constant(0.8);  // Kd, 0..1
  std::filesystem::path texture;      // map_Kd; empty: none
};

// A picture that a material names.
struct ObjTexture {
  std::filesystem::path file;
  std::string name;  // in the folder of a run: bust_textures/ and a unique name
};

struct MtlLine {
  std::string text;            // whole, or up to the name of the texture
  std::optional<int> texture;  // of ObjText::textures
};

struct ObjText {
  ObjFile file;
  std::vector<std::string> lines;  // of the file
  std::map<std::string, ObjMaterial> materials;
  std::vector<MtlLine> mtl;                      // the lines of the material libraries
  std::vector<ObjTexture> textures;              // each file once
  std::vector<std::filesystem::path> libraries;  // files of the material libraries
};

// Reads a file that ReadMesh has accepted. Names after `mtllib` or `map_` may contain spaces.
// Throws IoError for a material library or texture that cannot be read. Throws InputError for one
// outside the folder of the OBJ, for a `map_Kd` that is neither PNG nor JPEG, and as ReadObjFile
// does.
ObjText ReadObjText(const std::filesystem::path& path);

// The material libraries and textures of a mesh in OBJ; none for a mesh in another form. Throws as
// ReadObjText does.
std::vector<std::filesystem::path> MaterialFiles(const std::filesystem::path& mesh);

// The same lines with these points, without normals, and with `bust.mtl` as the only material
// library. points: as many as the file has. first_material: of faces before the first `usemtl`;
// empty: none.
std::string ObjWithPoints(const ObjText& obj, const std::vector<Vec3>& points,
                          std::string first_material);

// The material libraries joined into one, with the textures' names in the folder of a run.
std::string JoinMtl(const ObjText& obj);

}  // namespace semblance::problems
