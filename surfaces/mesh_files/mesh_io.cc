// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh_files/mesh_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cstring>
#include <set>
#include <utility>

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

// The part of a file that can state axes: the header of a PLY, the words of an STL, and the lines
// of an OBJ or OFF before the first vertex.
std::string_view HeaderOf(std::string_view bytes, const std::string& extension) {
  if (extension == ".ply") {
    return bytes.substr(0, bytes.find("end_header"));
  }
  if (extension == ".stl") {
    constexpr std::size_t kWords = 80, kLongestName = 1000;
    const std::size_t end = bytes.substr(0, kLongestName).find_first_of("\r\n");
    const bool may_be_text = bytes.starts_with("solid") && end != bytes.npos;
    return bytes.substr(0, may_be_text ? std::max(end, kWords) : kWords);
  }
  std::size_t at = 0;
  while (at < bytes.size() && std::string_view("vf+-.0123456789").find(bytes[at]) == bytes.npos) {
    at = std::min(bytes.find_first_of("\r\n", at), bytes.size() - 1) + 1;
  }
  return bytes.substr(0, at);
}

// The value after "SPACE=", in capitals; empty if there is none at or after `at`, which moves on.
std::string NextSpace(std::string_view header, std::size_t& at) {
  constexpr std::string_view kKey = "SPACE=";
  const auto is_letter = [](char c) {
    return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_';
  };
  for (at = header.find(kKey, at); at != header.npos; at = header.find(kKey, at)) {
    const bool is_word = at == 0 || !is_letter(header[at - 1]);
    at += kKey.size();
    std::string value;
    for (std::size_t k = at; is_word && k < header.size() && is_letter(header[k]); ++k) {
      value += static_cast<char>(std::toupper(static_cast<unsigned char>(header[k])));
    }
    if (!value.empty()) {
      return value;
    }
  }
  return "";
}

// True for other axes of anatomy, such as LAS or superior-anterior-right.
bool IsAnatomical(const std::string& value) {
  std::string letters;
  for (std::size_t at = 0; at < value.size(); at = value.find('-', at)) {
    at += value[at] == '-' ? 1 : 0;
    letters += value.substr(at, 1);
  }
  letters = value.size() == 3 ? value : letters;
  return letters.size() == 3 &&
         std::ranges::all_of(std::array{"LR", "AP", "IS"}, [&](std::string_view pair) {
           return letters.find_first_of(pair) != letters.npos;
         });
}

MeshAxes FindStatedAxes(std::string_view header, const std::string& name) {
  MeshAxes axes = MeshAxes::kUnstated;
  std::size_t at = 0;
  for (std::string value = NextSpace(header, at); !value.empty(); value = NextSpace(header, at)) {
    const bool lps = value == "LPS" || value == "LEFT-POSTERIOR-SUPERIOR",
               ras = value == "RAS" || value == "RIGHT-ANTERIOR-SUPERIOR";
    if (!lps && !ras && IsAnatomical(value)) {
      throw InputError(fmt::format(
          "{}: the file states SPACE={}; only LPS and RAS are read: save it again in one of these",
          name, Shown(value)));
    }
    const MeshAxes found = lps ? MeshAxes::kLps : ras ? MeshAxes::kRas : MeshAxes::kUnstated;
    if (found != MeshAxes::kUnstated && axes != MeshAxes::kUnstated && axes != found) {
      throw InputError(fmt::format(
          "{}: the file states SPACE=LPS and SPACE=RAS; take the wrong line out", name));
    }
    axes = found == MeshAxes::kUnstated ? axes : found;
  }
  return axes;
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

MeshFile ReadMeshFile(const std::filesystem::path& path) {
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
  return {std::move(mesh), FindStatedAxes(HeaderOf(bytes, extension), name)};
}

MeshAxes ReadStatedAxes(const std::filesystem::path& path) {
  return FindStatedAxes(HeaderOf(ReadFileBytes(path), LowerExtension(path)), path.string());
}

TriMesh ReadMeshInLps(const std::filesystem::path& path, std::vector<std::string>& notes) {
  MeshFile file = ReadMeshFile(path);
  if (file.axes == MeshAxes::kRas) {
    for (Vec3& p : file.mesh.points) {
      p = Vec3(-p.x(), -p.y(), p.z());
    }
    notes.push_back(fmt::format("{}: the file states SPACE=RAS; turned to LPS (x and y negated)",
                                path.filename().string()));
  }
  return std::move(file.mesh);
}

TriMesh ReadMesh(const std::filesystem::path& path) {
  MeshFile file = ReadMeshFile(path);
  if (file.axes == MeshAxes::kRas) {
    throw InputError(fmt::format(
        "{}: the file states SPACE=RAS, and this mesh must be in LPS; save it again in LPS",
        path.string()));
  }
  return std::move(file.mesh);
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
