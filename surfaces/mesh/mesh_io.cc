// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/mesh/mesh_io.h"

#include <fmt/format.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <sstream>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/ply_layout.h"

namespace semblance {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
};
using HalfedgeMesh = OpenMesh::PolyMesh_ArrayKernelT<Traits>;

// Takes what OpenMesh's readers find before it would become a halfedge mesh, which cannot hold
// non-manifold faces.
class ArrayImporter : public OpenMesh::IO::ImporterT<HalfedgeMesh> {
 public:
  explicit ArrayImporter(HalfedgeMesh& mesh) : ImporterT(mesh), points_(mesh) {}

  OpenMesh::FaceHandle add_face(const VHandles& corners) override {
    for (std::size_t c = 2; c < corners.size(); ++c) {
      triangles_.push_back({corners[0].idx(), corners[c - 1].idx(), corners[c].idx()});
    }
    return OpenMesh::FaceHandle(static_cast<int>(faces_++));
  }
  std::size_t n_faces() const override { return faces_; }

  // What a file may say of its faces beside their corners is not kept; the base would look the
  // faces up in the halfedge mesh.
  using ImporterT::set_color;
  using ImporterT::set_normal;
  void add_face_texcoords(OpenMesh::FaceHandle, OpenMesh::VertexHandle,
                          const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(OpenMesh::FaceHandle, OpenMesh::VertexHandle,
                          const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(OpenMesh::FaceHandle, int) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_color(OpenMesh::FaceHandle, const OpenMesh::Vec4f&) override {}
  void set_normal(OpenMesh::FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(OpenMesh::FaceHandle, const OpenMesh::Vec3d&) override {}

  TriMesh Take() {
    TriMesh mesh;
    for (const auto v : points_.vertices()) {
      const auto& p = points_.point(v);
      mesh.points.emplace_back(p[0], p[1], p[2]);
    }
    mesh.triangles = std::move(triangles_);
    return mesh;
  }

 private:
  HalfedgeMesh& points_;
  std::vector<Triangle> triangles_;
  std::size_t faces_ = 0;
};

// OpenMesh reports to std::cerr through streams of its own; libraries do not print.
class QuietOpenMesh {
 public:
  QuietOpenMesh() {
    omerr().disable();
    omlog().disable();
    omout().disable();
  }
  ~QuietOpenMesh() {
    omerr().enable();
    omlog().enable();
    omout().enable();
  }
};

std::string LowerExtension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

std::string StlDefect(std::string_view bytes) {
  if (bytes.starts_with("solid") && bytes.find("facet") != std::string_view::npos) {
    return bytes.find("endsolid") == std::string_view::npos ? "is truncated: it has no 'endsolid'"
                                                            : "";
  }
  if (bytes.size() < 84) {
    return fmt::format("is truncated: a binary STL has at least 84 bytes, it has {}", bytes.size());
  }
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + 80, sizeof triangles);
  const std::size_t expected = 84 + std::size_t{50} * triangles;
  return bytes.size() >= expected
             ? ""
             : fmt::format(
                   "is truncated: its header says {} triangles, that is {} bytes; it has {}",
                   triangles, expected, bytes.size());
}

std::string Defect(const std::string& extension, std::string_view bytes) {
  if (extension == ".ply") {
    return PlyDefect(bytes);
  }
  return extension == ".stl" ? StlDefect(bytes) : "";
}

void CheckExtension(const std::string& extension, const std::string& where) {
  static const std::set<std::string> kKnown = {".ply", ".obj", ".stl", ".off"};
  if (!kKnown.contains(extension)) {
    throw IoError(
        fmt::format("{}: '{}' is no mesh format that is known; use .ply, .obj, .stl or .off", where,
                    extension));
  }
}

void CheckMeshContents(const TriMesh& mesh, const std::string& name) {
  if (mesh.triangles.empty()) {
    throw InputError(fmt::format("{}: the mesh has no triangles", name));
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    if (!mesh.points[v].allFinite()) {
      throw InputError(fmt::format("{}: vertex {} is not finite; repair the mesh", name, v));
    }
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t v : mesh.triangles[t]) {
      if (v < 0 || v >= static_cast<std::int32_t>(mesh.points.size())) {
        throw InputError(fmt::format("{}: face {} names vertex {}; there are {}", name, t, v,
                                     mesh.points.size()));
      }
    }
  }
}

// An STL repeats the corners of its triangles; equal ones become one point, in the order of their
// first use.
TriMesh MergeEqualPoints(const TriMesh& soup) {
  std::map<std::array<double, 3>, std::int32_t> index;
  TriMesh mesh;
  std::vector<std::int32_t> renumbered;
  for (const Vec3& p : soup.points) {
    const auto [it, is_new] =
        index.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::int32_t>(mesh.points.size()));
    if (is_new) {
      mesh.points.push_back(p);
    }
    renumbered.push_back(it->second);
  }
  for (const Triangle& t : soup.triangles) {
    mesh.triangles.push_back({renumbered[t[0]], renumbered[t[1]], renumbered[t[2]]});
  }
  return mesh;
}

template <class T>
void AppendRaw(std::string& bytes, T value) {
  static_assert(std::endian::native == std::endian::little);
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

void AppendVector(std::string& bytes, const Vec3& v) {
  for (int a = 0; a < 3; ++a) {
    AppendRaw(bytes, static_cast<float>(v[a]));
  }
}

void CheckAttributes(const TriMesh& mesh, const MeshAttributes& attributes) {
  const auto fits = [&](std::size_t size) { return size == 0 || size == mesh.points.size(); };
  bool all_fit = fits(attributes.normals.size()) && fits(attributes.colors.size());
  for (const VertexScalar& scalar : attributes.scalars) {
    all_fit = all_fit && scalar.values.size() == mesh.points.size();
  }
  if (!all_fit) {
    throw InputError(fmt::format(
        "mesh attributes: each needs one entry for each of the {} vertices", mesh.points.size()));
  }
}

std::string PlyHeader(const TriMesh& mesh, const MeshAttributes& attributes) {
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment units mm, frame LPS\n";
  header += fmt::format("element vertex {}\nproperty float x\nproperty float y\nproperty float z\n",
                        mesh.points.size());
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

std::string EncodePly(const TriMesh& mesh, const MeshAttributes& attributes) {
  std::string bytes = PlyHeader(mesh, attributes);
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    AppendVector(bytes, mesh.points[v]);
    if (!attributes.normals.empty()) {
      AppendVector(bytes, attributes.normals[v]);
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

std::string EncodeThroughOpenMesh(const TriMesh& mesh, const std::string& extension) {
  const QuietOpenMesh quiet;
  HalfedgeMesh halfedges;
  for (const Vec3& p : mesh.points) {
    halfedges.add_vertex({p.x(), p.y(), p.z()});
  }
  for (const Triangle& t : mesh.triangles) {
    halfedges.add_face(OpenMesh::VertexHandle(t[0]), OpenMesh::VertexHandle(t[1]),
                       OpenMesh::VertexHandle(t[2]));
  }
  if (halfedges.n_faces() != mesh.triangles.size()) {
    throw InputError(fmt::format(
        "mesh: {} of {} triangles are non-manifold and would be lost in {}; write .ply instead",
        mesh.triangles.size() - halfedges.n_faces(), mesh.triangles.size(), extension));
  }
  std::ostringstream stream;
  OpenMesh::IO::Options options = OpenMesh::IO::Options::Default;
  if (extension == ".stl") {
    halfedges.request_face_normals();
    halfedges.update_face_normals();
    options = OpenMesh::IO::Options::Binary;
  }
  if (!OpenMesh::IO::write_mesh(halfedges, stream, extension, options, 9)) {
    throw InputError(fmt::format("mesh: it could not be written as {}", extension));
  }
  return stream.str();
}

}  // namespace

TriMesh ReadMesh(const std::filesystem::path& path) {
  const std::string name = path.string(), extension = LowerExtension(path);
  CheckExtension(extension, name);
  const std::string bytes = ReadFileBytes(path);
  if (bytes.empty()) {
    throw IoError(fmt::format("{}: the file is empty", name));
  }
  const std::string defect = Defect(extension, bytes);
  if (!defect.empty()) {
    throw IoError(fmt::format("{} {}", name, defect));
  }
  const QuietOpenMesh quiet;
  HalfedgeMesh points;
  ArrayImporter importer(points);
  OpenMesh::IO::Options options;
  if (!OpenMesh::IO::IOManager().read(name, importer, options)) {
    throw IoError(fmt::format("{}: it is no {} mesh that can be read", name, extension));
  }
  TriMesh mesh = importer.Take();
  CheckMeshContents(mesh, name);
  return extension == ".stl" ? MergeEqualPoints(mesh) : mesh;
}

std::string EncodeMesh(const TriMesh& mesh, const std::string& extension,
                       const MeshAttributes& attributes) {
  CheckExtension(extension, "mesh");
  CheckAttributes(mesh, attributes);
  return extension == ".ply" ? EncodePly(mesh, attributes) : EncodeThroughOpenMesh(mesh, extension);
}

}  // namespace semblance
