// SPDX-License-Identifier: GPL-3.0-or-later
// PLY: text, binary little-endian and binary big-endian.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance::surfaces {

// Reads the positions x, y, z of element 'vertex' and the polygons vertex_indices (or vertex_index)
// of element 'face', which become triangles, also concave ones (PolygonFans). Element 'tristrips'
// has the same list: each corner from the third on makes a triangle with the two before it, in
// alternating order, and -1 ends a strip. Coordinates of type double and of whole types keep all
// their digits. Other properties and elements are skipped. name: the file, for messages.
// Throws InputError with the line (text) or byte (binary) for anything else: data shorter or longer
// than the header says, fewer than 3 corners, an index out of range, a coordinate that is not
// finite.
TriMesh ReadPly(std::string_view bytes, const std::string& name);

// Reads the property `scalar` of every vertex, in order, of any number type; values may be NaN.
// Throws InputError as ReadPly does, and if the vertices have no such property or it is a list.
std::vector<double> ReadPlyVertexScalar(std::string_view bytes, const std::string& scalar,
                                        const std::string& name);

// Reads everything that the vertices carry beside x, y, z: nx, ny, nz as normals if all three
// exist; red, green, blue as colours if all three are of type uchar; every other plain property as
// a scalar of its own name, in the order of the file. Lists are skipped. Throws InputError as
// ReadPly does.
MeshAttributes ReadPlyAttributes(std::string_view bytes, const std::string& name);

enum class PlyFormat { kText, kLittleEndian, kBigEndian };
enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat;      // of a list: the type of its items
  std::optional<PlyType> length_type;  // of a list only
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  std::optional<PlyFormat> format;
  std::vector<PlyElement> elements;
  std::size_t bytes = 0;   // before the first byte of data
  std::int64_t lines = 0;  // before the first line of data
};

// Reads the header. The file must be long enough for the counts in the header, with lists counted
// as empty, so that reading takes at most a few times the memory of the file. Throws InputError
// with the line for anything else. name: the file, for messages.
PlyHeader ReadPlyHeader(std::string_view bytes, const std::string& name);

}  // namespace semblance::surfaces
