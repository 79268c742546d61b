// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes the readers of meshes. A mesh that is read is valid; any other input is an InputError. The
// input is the file itself. Its first byte selects the reader: 'p' PLY; 'O', 'C' or 'N' OFF; 's' or
// a byte that cannot be printed STL; any other OBJ.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "surfaces/base/error.h"
#include "surfaces/mesh_files/read_obj.h"
#include "surfaces/mesh_files/read_off.h"
#include "surfaces/mesh_files/read_ply.h"
#include "surfaces/mesh_files/read_stl.h"

namespace {

using semblance::surfaces::TriMesh;

TriMesh Read(std::string_view bytes) {
  const char first = bytes.empty() ? 'p' : bytes.front();
  if (first == 'p') {
    const TriMesh mesh = semblance::surfaces::ReadPly(bytes, "fuzz.ply");
    if (semblance::surfaces::ReadPlyVertexScalar(bytes, "x", "fuzz.ply").size() !=
        mesh.points.size()) {
      std::abort();
    }
    const semblance::surfaces::MeshAttributes more =
        semblance::surfaces::ReadPlyAttributes(bytes, "fuzz.ply");
    for (const auto& scalar : more.scalars) {
      if (scalar.values.size() != mesh.points.size()) {
        std::abort();
      }
    }
    return mesh;
  }
  if (first == 'O' || first == 'C' || first == 'N') {
    return semblance::surfaces::ReadOff(bytes, "fuzz.off");
  }
  const bool printable = first >= ' ' && first <= '~';
  return first == 's' || !printable ? semblance::surfaces::ReadStl(bytes, "fuzz.stl")
                                    : semblance::surfaces::ReadObj(bytes, "fuzz.obj");
}

void AbortUnlessValid(const TriMesh& mesh) {
  for (const semblance::surfaces::Vec3& p : mesh.points) {
    if (!p.allFinite()) {
      std::abort();
    }
  }
  for (const semblance::surfaces::Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.points.size()) {
        std::abort();
      }
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    AbortUnlessValid(Read({reinterpret_cast<const char*>(data), size}));
  } catch (const semblance::surfaces::InputError&) {
  }
  return 0;
}
