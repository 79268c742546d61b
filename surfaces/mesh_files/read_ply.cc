// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/read_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/ply_data.h"
#include "surfaces/mesh_files/ply_header.h"
#include "surfaces/mesh_files/read_parts.h"

namespace semblance {
namespace {

// Whether it is whole and in [0, end).
bool IsIndex(double value, double end) {
  return value >= 0 && value < end && value == std::floor(value);
}

template <class Data>
std::size_t ListLength(Data& data, const PlyProperty& list) {
  const double length = data.Next(*list.length_type);
  const std::size_t most = data.MostItems(list.type);
  if (!IsIndex(length, static_cast<double>(most) + 1)) {
    data.Fail(
        fmt::format("a list '{}' of {} items, but there is room for {}; the file is truncated "
                    "or damaged: write it again",
                    Shown(list.name), length, most));
  }
  return static_cast<std::size_t>(length);
}

// Goes through an element. on_value(row, k, value): a value of property k, or an item of its list.
// on_row(row): after the row's last value.
template <class Data, class OnValue, class OnRow>
void ForEachValue(Data& data, const PlyElement& element, const OnValue& on_value,
                  const OnRow& on_row) {
  if (element.properties.empty()) {
    return;
  }
  for (std::int64_t row = 0; row < element.count; ++row) {
    data.BeginRow(element, row);
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const PlyProperty& property = element.properties[k];
      const std::size_t length = property.length_type ? ListLength(data, property) : 1;
      for (std::size_t item = 0; item < length; ++item) {
        on_value(row, k, data.Next(property.type));
      }
    }
    data.EndRow();
    on_row(row);
  }
}

PlyElement& FindElement(PlyHeader& header, const std::string& wanted, const std::string& name) {
  for (PlyElement& element : header.elements) {
    if (element.name == wanted) {
      return element;
    }
  }
  throw InputError(
      fmt::format("{}: line {}: the header has no element '{}'; export a mesh of "
                  "vertices and faces",
                  name, header.lines, wanted));
}

std::optional<std::size_t> FindProperty(const PlyElement& element, const std::string& wanted) {
  for (std::size_t k = 0; k < element.properties.size(); ++k) {
    if (element.properties[k].name == wanted) {
      return k;
    }
  }
  return std::nullopt;
}

// The property of each axis, a plain number.
std::array<std::size_t, 3> FindAxes(const PlyElement& vertex, const std::string& name) {
  std::array<std::size_t, 3> axes;
  const std::array<std::string, 3> names = {"x", "y", "z"};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto found = FindProperty(vertex, names[a]);
    if (!found || vertex.properties[*found].length_type) {
      throw InputError(
          fmt::format("{}: the header's vertices have no plain property '{}'; they need x, y and z",
                      name, names[a]));
    }
    axes[a] = *found;
  }
  return axes;
}

// The list of a face's vertices.
std::size_t FindCorners(const PlyElement& face, const std::string& name) {
  auto found = FindProperty(face, "vertex_indices");
  found = found ? found : FindProperty(face, "vertex_index");
  if (!found || !face.properties[*found].length_type || !IsWhole(face.properties[*found].type)) {
    throw InputError(
        fmt::format("{}: the header's faces have no list of whole numbers 'vertex_indices'; write "
                    "'property list uchar int vertex_indices'",
                    name));
  }
  return *found;
}

template <class Data>
std::vector<Vec3> ReadPoints(Data& data, const PlyElement& vertex, const std::string& name) {
  const auto axes = FindAxes(vertex, name);
  std::vector<Vec3> points(static_cast<std::size_t>(vertex.count));
  ForEachValue(
      data, vertex,
      [&](std::int64_t row, std::size_t k, double value) {
        for (std::size_t a = 0; a < 3; ++a) {
          if (axes[a] == k) {
            points[static_cast<std::size_t>(row)][static_cast<int>(a)] = value;
          }
        }
      },
      [&](std::int64_t row) {
        if (!points[static_cast<std::size_t>(row)].allFinite()) {
          data.Fail(fmt::format("vertex {} is not finite; remove it or repair the mesh", row));
        }
      });
  return points;
}

template <class Data>
std::vector<Triangle> ReadFaces(Data& data, const PlyElement& face, std::int64_t points,
                                const std::string& name) {
  const std::size_t list = FindCorners(face, name);
  std::vector<Triangle> triangles;
  triangles.reserve(static_cast<std::size_t>(face.count));
  std::vector<std::int32_t> corners;
  ForEachValue(
      data, face,
      [&](std::int64_t row, std::size_t k, double value) {
        if (k != list) {
          return;
        }
        if (!IsIndex(value, static_cast<double>(points))) {
          data.Fail(fmt::format("face {} names vertex {}; there are {}, numbered from 0", row,
                                value, points));
        }
        corners.push_back(static_cast<std::int32_t>(value));
      },
      [&](std::int64_t row) {
        if (corners.size() < 3) {
          data.Fail(
              fmt::format("face {} has {} corners; it needs at least 3", row, corners.size()));
        }
        AppendFan(corners, triangles);
        corners.clear();
      });
  return triangles;
}

template <class Data>
TriMesh ReadMeshData(Data data, PlyHeader& header, const std::string& name) {
  const PlyElement& vertex = FindElement(header, "vertex", name);
  const PlyElement& face = FindElement(header, "face", name);
  TriMesh mesh;
  for (const PlyElement& element : header.elements) {
    if (&element == &vertex) {
      mesh.points = ReadPoints(data, vertex, name);
    } else if (&element == &face) {
      mesh.triangles = ReadFaces(data, face, vertex.count, name);
    } else {
      ForEachValue(
          data, element, [](auto...) {}, [](auto...) {});
    }
  }
  data.End();
  return mesh;
}

template <class Data>
std::vector<double> ReadScalar(Data data, const PlyHeader& header, const PlyElement& vertex,
                               std::size_t scalar) {
  std::vector<double> values;
  values.reserve(static_cast<std::size_t>(vertex.count));
  for (const PlyElement& element : header.elements) {
    ForEachValue(
        data, element,
        [&](std::int64_t, std::size_t k, double value) {
          if (&element == &vertex && k == scalar) {
            values.push_back(value);
          }
        },
        [](auto...) {});
  }
  data.End();
  return values;
}

std::string Names(const PlyElement& element) {
  std::string names;
  for (const PlyProperty& property : element.properties) {
    names += (names.empty() ? "" : ", ") + Shown(property.name);
  }
  constexpr std::size_t kLongest = 400;
  return names.size() > kLongest ? names.substr(0, kLongest) + "..." : names;
}

// Where each property of a vertex goes.
struct PlyColumns {
  std::optional<std::array<std::size_t, 3>> normal, colour;
  std::vector<std::size_t> scalars;
};

// The properties of these names, all plain.
std::optional<std::array<std::size_t, 3>> FindThree(const PlyElement& vertex,
                                                    const std::array<std::string, 3>& names) {
  std::array<std::size_t, 3> three;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto found = FindProperty(vertex, names[k]);
    if (!found || vertex.properties[*found].length_type) {
      return std::nullopt;
    }
    three[k] = *found;
  }
  return three;
}

PlyColumns ColumnsOf(const PlyElement& vertex) {
  PlyColumns columns{.normal = FindThree(vertex, {"nx", "ny", "nz"}),
                     .colour = FindThree(vertex, {"red", "green", "blue"}),
                     .scalars = {}};
  if (columns.colour && std::ranges::any_of(*columns.colour, [&](std::size_t k) {
        return vertex.properties[k].type != PlyType::kUint8;
      })) {
    columns.colour.reset();
  }
  const auto is_of = [](const std::optional<std::array<std::size_t, 3>>& three, std::size_t k) {
    return three && std::ranges::find(*three, k) != three->end();
  };
  for (std::size_t k = 0; k < vertex.properties.size(); ++k) {
    const PlyProperty& property = vertex.properties[k];
    const bool is_axis = property.name == "x" || property.name == "y" || property.name == "z";
    if (!is_axis && !property.length_type && !is_of(columns.normal, k) &&
        !is_of(columns.colour, k)) {
      columns.scalars.push_back(k);
    }
  }
  return columns;
}

// In text any number may stand there.
template <class Data>
void CheckColour(const Data& data, const std::vector<double>& row, const PlyColumns& columns,
                 std::int64_t vertex) {
  constexpr double kColours = 256;
  for (std::size_t k = 0; columns.colour && k < 3; ++k) {
    if (const double value = row[(*columns.colour)[k]]; !IsIndex(value, kColours)) {
      data.Fail(fmt::format("vertex {} has a colour of {}; allowed are whole numbers from 0 to 255",
                            vertex, value));
    }
  }
}

// One row of values as the attributes of a vertex.
void AppendVertex(const std::vector<double>& row, const PlyColumns& columns,
                  MeshAttributes& attributes) {
  if (columns.normal) {
    const auto& n = *columns.normal;
    attributes.normals.emplace_back(row[n[0]], row[n[1]], row[n[2]]);
  }
  if (columns.colour) {
    const auto byte = [&](std::size_t k) { return static_cast<std::uint8_t>(row[k]); };
    const auto& c = *columns.colour;
    attributes.colors.push_back({byte(c[0]), byte(c[1]), byte(c[2])});
  }
  for (std::size_t k = 0; k < columns.scalars.size(); ++k) {
    attributes.scalars[k].values.push_back(row[columns.scalars[k]]);
  }
}

template <class Data>
MeshAttributes ReadAttributesData(Data data, const PlyHeader& header, const PlyElement& vertex) {
  const PlyColumns columns = ColumnsOf(vertex);
  MeshAttributes attributes;
  for (const std::size_t k : columns.scalars) {
    attributes.scalars.push_back({vertex.properties[k].name, {}});
  }
  std::vector<double> row(vertex.properties.size());
  for (const PlyElement& element : header.elements) {
    const bool is_vertex = &element == &vertex;
    ForEachValue(
        data, element,
        [&](std::int64_t, std::size_t k, double value) {
          if (is_vertex) {
            row[k] = value;
          }
        },
        [&](std::int64_t vertex_number) {
          if (is_vertex) {
            CheckColour(data, row, columns, vertex_number);
            AppendVertex(row, columns, attributes);
          }
        });
  }
  data.End();
  return attributes;
}

}  // namespace

TriMesh ReadPly(std::string_view bytes, const std::string& name) {
  PlyHeader header = ReadPlyHeader(bytes, name);
  return header.format == PlyFormat::kText
             ? ReadMeshData(PlyTextData(bytes, header, name), header, name)
             : ReadMeshData(PlyBinaryData(bytes, header, name), header, name);
}

std::vector<double> PlyVertexScalar(std::string_view bytes, const std::string& scalar,
                                    const std::string& name) {
  PlyHeader header = ReadPlyHeader(bytes, name);
  PlyElement& vertex = FindElement(header, "vertex", name);
  const auto found = FindProperty(vertex, scalar);
  if (!found || vertex.properties[*found].length_type) {
    throw InputError(
        fmt::format("{}: a vertex has no '{}'; it has {}", name, Shown(scalar), Names(vertex)));
  }
  if (header.format == PlyFormat::kText) {
    vertex.properties[*found].type = PlyType::kDouble;  // all the digits there are
  }
  return header.format == PlyFormat::kText
             ? ReadScalar(PlyTextData(bytes, header, name), header, vertex, *found)
             : ReadScalar(PlyBinaryData(bytes, header, name), header, vertex, *found);
}

MeshAttributes ReadPlyAttributes(std::string_view bytes, const std::string& name) {
  PlyHeader header = ReadPlyHeader(bytes, name);
  const PlyElement& vertex = FindElement(header, "vertex", name);
  return header.format == PlyFormat::kText
             ? ReadAttributesData(PlyTextData(bytes, header, name), header, vertex)
             : ReadAttributesData(PlyBinaryData(bytes, header, name), header, vertex);
}

}  // namespace semblance
