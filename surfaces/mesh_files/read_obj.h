// SPDX-License-Identifier: GPL-3.0-or-later
// Wavefront OBJ.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

// Reads the vertices (TextLines::NextPoint) and polygons of an OBJ; polygons become triangles, also
// concave ones (PolygonFans). A line may go on in the next one after a backslash.
// Indices may be relative (-1 is the last vertex so far). A corner that repeats an earlier one of
// its face is dropped, and so is a face without area. Texture, normals, groups, materials, lines
// and points are skipped. name: the file, for messages. Throws InputError with the line for
// anything else: an unknown keyword, fewer than 3 corners, an index out of range, a coordinate that
// is not finite.
TriMesh ReadObj(std::string_view bytes, const std::string& name);

struct ObjPolygonCorner {
  std::int32_t point = -1;
  std::int32_t texture = -1;  // index of a texture coordinate; -1: none
};

// A face of the file with all its corners, repeated ones too.
struct ObjPolygon {
  std::vector<ObjPolygonCorner> corners;
  std::string material;  // of the last `usemtl`; empty before the first
};

// Everything in an OBJ that decides its looks.
struct ObjFile {
  TriMesh mesh;               // as ReadObj returns it
  std::vector<Vec2> texture;  // texture coordinates as written, v upwards
  std::vector<Vec3> colours;  // sRGB, 0..1, one per point; empty unless every point has a colour
  std::vector<ObjPolygon> polygons;
  std::vector<std::string> libraries;  // the rest of each `mtllib` line: one name or several
};

// Throws InputError as ReadObj does, and for a texture coordinate that is not finite or missing.
ObjFile ReadObjFile(std::string_view bytes, const std::string& name);

}  // namespace semblance::surfaces
