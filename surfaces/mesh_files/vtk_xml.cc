// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/vtk_xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <string_view>
#include <vector>

#include "surfaces/base/encoding.h"

namespace semblance::surfaces {
namespace {

constexpr std::uint8_t kTriangle = 5;  // the number of the cell type in VTK

template <class T>
constexpr const char* kVtkType = nullptr;
template <>
constexpr const char* kVtkType<double> = "Float64";
template <>
constexpr const char* kVtkType<std::int64_t> = "Int64";
template <>
constexpr const char* kVtkType<std::uint8_t> = "UInt8";

// One array as Base64: its size in bytes, then its numbers.
template <class T>
std::string ArrayXml(const std::string& name, int components, const std::vector<T>& numbers) {
  std::string bytes;
  bytes.reserve(8 + numbers.size() * sizeof(T));
  AppendRaw(bytes, static_cast<std::uint64_t>(numbers.size() * sizeof(T)));
  for (const T number : numbers) {
    AppendRaw(bytes, number);
  }
  return fmt::format(
      "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"binary\">\n{}\n"
      "</DataArray>\n",
      kVtkType<T>, name, components, Base64(bytes));
}

std::vector<double> Flat(const std::vector<Vec3>& vectors) {
  std::vector<double> numbers;
  numbers.reserve(3 * vectors.size());
  for (const Vec3& v : vectors) {
    numbers.insert(numbers.end(), {v.x(), v.y(), v.z()});
  }
  return numbers;
}

std::vector<std::int64_t> Corners(const TriMesh& mesh) {
  std::vector<std::int64_t> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    corners.insert(corners.end(), t.begin(), t.end());
  }
  return corners;
}

std::vector<std::int64_t> Offsets(std::size_t triangles) {
  std::vector<std::int64_t> offsets(triangles);
  for (std::size_t k = 0; k < triangles; ++k) {
    offsets[k] = static_cast<std::int64_t>(3 * (k + 1));
  }
  return offsets;
}

// The name without characters that XML or a list of names in VTK cannot hold.
std::string PlainName(std::string_view name) {
  constexpr std::string_view kPrefix = "scalar_";
  if (name.starts_with(kPrefix) && name.size() > kPrefix.size()) {
    name.remove_prefix(kPrefix.size());
  }
  std::string plain;
  for (const char c : name) {
    const bool holds = c > ' ' && c < 0x7F && std::string_view("<>&\"'").find(c) == name.npos;
    plain += holds ? c : '_';
  }
  return plain;
}

// True if the values are equal; NaN equals NaN.
bool SameValues(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(
      a, b, [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); });
}

struct NamedValues {
  std::string name;
  const std::vector<double>* values = nullptr;
};

bool RepeatsAnother(const VertexScalar& scalar, const std::vector<VertexScalar>& all) {
  return scalar.name == "quality" && std::ranges::any_of(all, [&](const VertexScalar& other) {
           return &other != &scalar && SameValues(other.values, scalar.values);
         });
}

std::vector<NamedValues> ValuesToWrite(const std::vector<VertexScalar>& scalars) {
  std::vector<NamedValues> written;
  std::set<std::string> taken = {"Normals", "RGB"};
  for (const VertexScalar& scalar : scalars) {
    if (RepeatsAnother(scalar, scalars)) {
      continue;
    }
    const std::string plain = PlainName(scalar.name);
    std::string name = plain;
    for (int k = 2; !taken.insert(name).second; ++k) {
      name = fmt::format("{}_{}", plain, k);
    }
    written.push_back({name, &scalar.values});
  }
  return written;
}

std::string PointDataXml(const MeshAttributes& attributes) {
  const std::vector<NamedValues> values = ValuesToWrite(attributes.scalars);
  std::string text = "<PointData";
  text += values.empty() ? "" : fmt::format(" Scalars=\"{}\"", values[0].name);
  text += attributes.normals.empty() ? ">\n" : " Normals=\"Normals\">\n";
  for (const NamedValues& value : values) {
    text += ArrayXml(value.name, 1, *value.values);
  }
  if (!attributes.normals.empty()) {
    text += ArrayXml("Normals", 3, Flat(attributes.normals));
  }
  if (!attributes.colors.empty()) {
    std::vector<std::uint8_t> channels;
    for (const auto& colour : attributes.colors) {
      channels.insert(channels.end(), colour.begin(), colour.end());
    }
    text += ArrayXml("RGB", 3, channels);
  }
  return text + "</PointData>\n";
}

// kind: of the data set. counts, cells: the parts that follow the points in the head and the body
// of the piece.
std::string FileXml(const char* kind, const std::string& counts, const std::string& cells,
                    const TriMesh& mesh, const MeshAttributes& attributes) {
  CheckAttributes(mesh.points.size(), attributes);
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<!-- mm; LPS: +x subject left, +y posterior, +z up -->\n<{0}>\n"
      "<Piece NumberOfPoints=\"{1}\" {2}>\n{3}<Points>\n{4}</Points>\n{5}</Piece>\n</{0}>\n"
      "</VTKFile>\n",
      kind, mesh.points.size(), counts, PointDataXml(attributes),
      ArrayXml("Points", 3, Flat(mesh.points)), cells);
}

std::string ConnectivityXml(const TriMesh& mesh) {
  return ArrayXml("connectivity", 1, Corners(mesh)) +
         ArrayXml("offsets", 1, Offsets(mesh.triangles.size()));
}

}  // namespace

std::string EncodeVtp(const TriMesh& mesh, const MeshAttributes& attributes) {
  const std::string counts = fmt::format(
      "NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\"",
      mesh.triangles.size());
  return FileXml("PolyData", counts, "<Polys>\n" + ConnectivityXml(mesh) + "</Polys>\n", mesh,
                 attributes);
}

std::string EncodeVtu(const TriMesh& mesh, const MeshAttributes& attributes) {
  const std::string types =
      ArrayXml("types", 1, std::vector<std::uint8_t>(mesh.triangles.size(), kTriangle));
  return FileXml("UnstructuredGrid", fmt::format("NumberOfCells=\"{}\"", mesh.triangles.size()),
                 "<Cells>\n" + ConnectivityXml(mesh) + types + "</Cells>\n", mesh, attributes);
}

}  // namespace semblance::surfaces
