// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_files/surface_export.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>

#include "surfaces/base/error.h"
#include "surfaces/hspline/patch_tree.h"

namespace semblance {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kBezierQuadrilateral = 77;  // VTK's number

// The Bezier points of a cubic from those of the uniform B-spline, along one direction.
constexpr double kBezier[4][4] = {{1.0 / 6, 4.0 / 6, 1.0 / 6, 0},
                                  {0, 4.0 / 6, 2.0 / 6, 0},
                                  {0, 2.0 / 6, 4.0 / 6, 0},
                                  {0, 1.0 / 6, 4.0 / 6, 1.0 / 6}};

// VTK's order of the sixteen points, as a + 4 b: corners around, the edges below, right, above and
// left, each in the direction of growing parameters, then the inner ones row by row.
constexpr int kVtkOrder[16] = {0, 3, 15, 12, 1, 2, 7, 11, 13, 14, 4, 8, 5, 6, 9, 10};

std::array<Vec3, 16> BezierPoints(const std::array<Vec3, 16>& vertices) {
  std::array<Vec3, 16> points;
  for (int k = 0; k < 16; ++k) {
    points[k] = Vec3::Zero();
    for (int m = 0; m < 16; ++m) {
      points[k] += kBezier[k % 4][m % 4] * kBezier[k / 4][m / 4] * vertices[m];
    }
  }
  return points;
}

// One array of VTK's XML; `value(k)` is the text of entry k.
template <class Value>
void AppendArray(std::string& text, const char* attributes, std::size_t count, const Value& value) {
  fmt::format_to(std::back_inserter(text), "<DataArray {} format=\"ascii\">\n", attributes);
  for (std::size_t k = 0; k < count; ++k) {
    text += value(k);
    text += '\n';
  }
  text += "</DataArray>\n";
}

std::string PatchPointsText(const HSplineSurface& surface, const PatchId& patch) {
  const std::array<Vec3, 16> points = BezierPoints(surface.PatchVertices(patch));
  std::string text;
  for (const int k : kVtkOrder) {
    fmt::format_to(std::back_inserter(text), "{} {} {} ", points[k].x(), points[k].y(),
                   points[k].z());
  }
  return text;
}

// glTF's numbers are little-endian whatever the machine.
template <class Integer>
void AppendLittle(std::string& bytes, Integer value) {
  for (std::size_t k = 0; k < sizeof(Integer); ++k) {
    bytes += static_cast<char>(value >> (8 * k) & 0xff);
  }
}

void AppendVec(std::string& bytes, const Eigen::Vector3f& v) {
  for (const float x : {v.x(), v.y(), v.z()}) {
    AppendLittle(bytes, std::bit_cast<std::uint32_t>(x));
  }
}

// From LPS to glTF's axes: +z up becomes +y up, the face looks along +z.
Eigen::Vector3f ToGltf(const Vec3& v) { return Vec3(v.x(), v.z(), -v.y()).cast<float>(); }

std::string GlbBytes(const Json& json, std::string binary) {
  std::string text = json.dump();
  text.append((4 - text.size() % 4) % 4, ' ');
  binary.append((4 - binary.size() % 4) % 4, '\0');
  std::string bytes = "glTF";
  AppendLittle(bytes, std::uint32_t{2});
  AppendLittle(bytes, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
  AppendLittle(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += "JSON" + text;
  AppendLittle(bytes, static_cast<std::uint32_t>(binary.size()));
  bytes.append("BIN\0", 4);
  return bytes + binary;
}

Json VecToJson(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

// The document that describes `points` points, as many normals and `corners` indices after them.
Json GltfDocument(std::size_t points, std::size_t corners, const Eigen::AlignedBox3f& box) {
  constexpr int kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kIndices = 34963;
  const std::size_t size = 12 * points;
  Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "semblance"}};
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", {0}}}});
  json["nodes"] = Json::array({{{"mesh", 0}}});
  const Json attributes = {{"POSITION", 0}, {"NORMAL", 1}};
  json["meshes"] =
      Json::array({{{"primitives", Json::array({{{"attributes", attributes}, {"indices", 2}}})}}});
  json["buffers"] = Json::array({{{"byteLength", 2 * size + 4 * corners}}});
  const auto view = [](std::size_t offset, std::size_t length, int target) {
    return Json{{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}};
  };
  json["bufferViews"] = Json::array({view(0, size, kVertices), view(size, size, kVertices),
                                     view(2 * size, 4 * corners, kIndices)});
  const auto accessor = [](int buffer_view, int component, std::size_t count, const char* type) {
    return Json{{"bufferView", buffer_view},
                {"componentType", component},
                {"count", count},
                {"type", type}};
  };
  json["accessors"] =
      Json::array({accessor(0, kFloat, points, "VEC3"), accessor(1, kFloat, points, "VEC3"),
                   accessor(2, kUnsigned, corners, "SCALAR")});
  json["accessors"][0]["min"] = VecToJson(box.min());
  json["accessors"][0]["max"] = VecToJson(box.max());
  return json;
}

}  // namespace

std::string SurfaceToVtu(const HSplineSurface& surface) {
  const PatchTree tree(surface);
  const std::vector<PatchId>& patches = tree.leaves();
  const std::size_t count = patches.size();
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"2.2\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<UnstructuredGrid>\n"
      "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<Points>\n",
      16 * count, count);
  AppendArray(text, "type=\"Float64\" NumberOfComponents=\"3\"", count,
              [&](std::size_t k) { return PatchPointsText(surface, patches[k]); });
  text += "</Points>\n<Cells>\n";
  AppendArray(text, "type=\"Int64\" Name=\"connectivity\"", 16 * count,
              [](std::size_t k) { return fmt::format("{}", k); });
  AppendArray(text, "type=\"Int64\" Name=\"offsets\"", count,
              [](std::size_t k) { return fmt::format("{}", 16 * (k + 1)); });
  AppendArray(text, "type=\"UInt8\" Name=\"types\"", count,
              [](std::size_t) { return fmt::format("{}", kBezierQuadrilateral); });
  text += "</Cells>\n<CellData>\n";
  AppendArray(text, "type=\"Int32\" Name=\"level\"", count,
              [&](std::size_t k) { return fmt::format("{}", patches[k].level); });
  return text + "</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}

std::string TessellationToGlb(const Tessellation& tessellation) {
  const TriMesh& mesh = tessellation.mesh;
  if (mesh.triangles.empty() || tessellation.normals.size() != mesh.points.size()) {
    throw InputError(fmt::format(
        "glTF: {} triangles, {} points and {} normals; at least one triangle and one normal a "
        "point are needed",
        mesh.triangles.size(), mesh.points.size(), tessellation.normals.size()));
  }
  const std::vector<Vec3> of_triangles = VertexNormals(mesh);
  std::string points, normals, corners;
  Eigen::AlignedBox3f box;
  for (std::size_t k = 0; k < mesh.points.size(); ++k) {
    const Eigen::Vector3f point = ToGltf(mesh.points[k] / 1000);
    box.extend(point);
    AppendVec(points, point);
    Vec3 normal = tessellation.normals[k].isZero() ? of_triangles[k] : tessellation.normals[k];
    AppendVec(normals, ToGltf(normal.isZero() ? -Vec3::UnitY() : normal));  // glTF allows no zero
  }
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::int32_t corner : triangle) {
      AppendLittle(corners, static_cast<std::uint32_t>(corner));
    }
  }
  return GlbBytes(GltfDocument(mesh.points.size(), 3 * mesh.triangles.size(), box),
                  points + normals + corners);
}

}  // namespace semblance
