// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/encoding.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/mesh_files/read_obj.h"
#include "surfaces/mesh_files/read_off.h"
#include "surfaces/mesh_files/read_ply.h"
#include "surfaces/mesh_files/read_stl.h"
#include "surfaces/mesh_files/text_lines.h"

namespace semblance::surfaces {
namespace {

std::string LowerExtension(const std::filesystem::path& path) {
  return LowerCase(path.extension().string());
}

void CheckExtension(const std::string& extension, const std::string& where) {
  static const std::set<std::string> kKnown = {".ply", ".obj", ".stl", ".off"};
  if (!kKnown.contains(extension)) {
    throw IoError(fmt::format("{}: '{}' is not a known mesh format; use .ply, .obj, .stl or .off",
                              where, extension));
  }
}

TriMesh Decode(std::string_view bytes, const std::string& extension, const std::string& name) {
  return extension == ".ply"   ? ReadPly(bytes, name)
         : extension == ".obj" ? ReadObj(bytes, name)
         : extension == ".off" ? ReadOff(bytes, name)
                               : ReadStl(bytes, name);
}

enum class Precision { kSingle, kDouble };

void AppendVector(std::string& bytes, const Vec3& v, Precision precision) {
  for (int a = 0; a < 3; ++a) {
    if (precision == Precision::kDouble) {
      AppendRaw(bytes, v[a]);
    } else {
      AppendRaw(bytes, static_cast<float>(v[a]));
    }
  }
}

// Double if single precision would lose detail that the mesh shows; see EncodeMesh.
Precision PrecisionFor(const TriMesh& mesh, double chord_mm) {
  constexpr double kOfChord = 0.02, kOfExtent = 1e-5;
  const Box3 box = Bounds(mesh);
  if (box.isEmpty()) {
    return Precision::kSingle;
  }
  const double largest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  const double needed_mm =
      std::min({kCoordinateStep_mm, kOfChord * chord_mm, kOfExtent * box.diagonal().norm()});
  return SingleStep(largest) > needed_mm ? Precision::kDouble : Precision::kSingle;
}

std::string MakePlyHeader(const TriMesh& mesh, const MeshAttributes& attributes,
                          Precision precision) {
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment units mm, frame LPS\n";
  header += fmt::format("element vertex {0}\nproperty {1} x\nproperty {1} y\nproperty {1} z\n",
                        mesh.points.size(), precision == Precision::kDouble ? "double" : "float");
  if (!attributes.normals.empty()) {
    header += "property float nx\nproperty float ny\nproperty float nz\n";
  }
  if (!attributes.colors.empty()) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  for (const VertexScalar& scalar : attributes.scalars) {
    header += fmt::format("property float {}\n", scalar.name);
  }
  return header +
         fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                     mesh.triangles.size());
}

std::string EncodePly(const TriMesh& mesh, const MeshAttributes& attributes, Precision precision) {
  std::string bytes = MakePlyHeader(mesh, attributes, precision);
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    AppendVector(bytes, mesh.points[v], precision);
    if (!attributes.normals.empty()) {
      AppendVector(bytes, attributes.normals[v], Precision::kSingle);
    }
    for (std::size_t c = 0; c < 3 && !attributes.colors.empty(); ++c) {
      AppendRaw(bytes, attributes.colors[v][c]);
    }
    for (const VertexScalar& scalar : attributes.scalars) {
      AppendRaw(bytes, static_cast<float>(scalar.values[v]));
    }
  }
  for (const Triangle& t : mesh.triangles) {
    AppendRaw(bytes, std::uint8_t{3});
    for (const std::int32_t v : t) {
      AppendRaw(bytes, v);
    }
  }
  return bytes;
}

// With enough digits that a reader gets the same number of that precision.
std::string CoordinatesText(const Vec3& p, Precision precision) {
  const Vec3 single = p.cast<float>().cast<double>();
  return precision == Precision::kDouble
             ? fmt::format("{} {} {}", p.x(), p.y(), p.z())
             : fmt::format("{:.9g} {:.9g} {:.9g}", single.x(), single.y(), single.z());
}

std::string EncodeObj(const TriMesh& mesh, Precision precision) {
  std::string text =
      fmt::format("# {} vertices, {} faces\n", mesh.points.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.points) {
    text += "v " + CoordinatesText(p, precision) + "\n";
  }
  for (const Triangle& t : mesh.triangles) {
    text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  return text;
}

std::string EncodeOff(const TriMesh& mesh, Precision precision) {
  std::string text = fmt::format("OFF\n{} {} 0\n", mesh.points.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.points) {
    text += CoordinatesText(p, precision) + "\n";
  }
  for (const Triangle& t : mesh.triangles) {
    text += fmt::format("3 {} {} {} \n", t[0], t[1], t[2]);
  }
  return text;
}

// 80 bytes of words, the number of triangles, and per triangle its unit normal, its corners and two
// bytes of attributes.
std::string EncodeStl(const TriMesh& mesh) {
  constexpr std::size_t kWords = 80;
  std::string bytes = "binary stl file";
  bytes.resize(kWords - 1, ' ');
  bytes += '\0';
  AppendRaw(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    const Vec3 area_vector = TriangleAreaVector(mesh, t);
    const double area = area_vector.norm();
    AppendVector(bytes, area > 0 ? Vec3(area_vector / area) : Vec3(Vec3::Zero()),
                 Precision::kSingle);
    for (const std::int32_t v : t) {
      AppendVector(bytes, mesh.points[v], Precision::kSingle);
    }
    AppendRaw(bytes, std::uint16_t{0});
  }
  return bytes;
}

}  // namespace

void CheckAttributes(std::size_t vertices, const MeshAttributes& attributes) {
  const auto fits = [&](std::size_t size) { return size == 0 || size == vertices; };
  bool all_fit = fits(attributes.normals.size()) && fits(attributes.colors.size());
  for (const VertexScalar& scalar : attributes.scalars) {
    all_fit = all_fit && scalar.values.size() == vertices;
  }
  if (!all_fit) {
    throw InputError(
        fmt::format("mesh attributes: each needs one entry for each of the {} vertices", vertices));
  }
}

TriMesh ReadMesh(const std::filesystem::path& path) {
  const std::string name = path.string(), extension = LowerExtension(path);
  CheckExtension(extension, name);
  const std::string bytes = ReadFileBytes(path);
  if (bytes.empty()) {
    throw IoError(fmt::format("{}: the file is empty", name));
  }
  TriMesh mesh = Decode(bytes, extension, name);
  if (mesh.triangles.empty()) {
    throw InputError(fmt::format("{}: the mesh has no triangles; give a surface", name));
  }
  if (mesh.triangles.size() > kMaxElements) {
    throw InputError(fmt::format("{}: the mesh has {} triangles; at most {} are allowed", name,
                                 mesh.triangles.size(), kMaxElements));
  }
  return mesh;
}

std::string EncodeMesh(const TriMesh& mesh, const std::string& extension,
                       const MeshAttributes& attributes, double chord_mm) {
  CheckExtension(extension, "mesh");
  CheckAttributes(mesh.points.size(), attributes);
  const Precision precision = PrecisionFor(mesh, chord_mm);
  return extension == ".ply"   ? EncodePly(mesh, attributes, precision)
         : extension == ".obj" ? EncodeObj(mesh, precision)
         : extension == ".off" ? EncodeOff(mesh, precision)
                               : EncodeStl(mesh);
}

}  // namespace semblance::surfaces
