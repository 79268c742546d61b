// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/exports/export_file.h"

#include <fmt/format.h>

#include <set>

#include "problems/exports/mesh_export.h"
#include "problems/exports/run_scene.h"
#include "surfaces/base/error.h"
#include "surfaces/base/lower_case.h"
#include "surfaces/hspline_files/face_export.h"
#include "surfaces/hspline_files/hspline_json.h"

namespace semblance {
namespace {

namespace fs = std::filesystem;

void RefuseChord(const fs::path& from, const ExportOptions& options) {
  if (options.chord_mm) {
    throw InputError(fmt::format(
        "{}: its triangles are written as they are; leave --chord_mm away, or export the H-spline "
        "(face.hspline.json)",
        from.string()));
  }
}

std::string RunBytes(const fs::path& folder, const ExportOptions& options) {
  RefuseChord(folder, options);
  if (LowerCase(options.extension) != ".glb") {
    throw InputError(fmt::format(
        "{}: a run's folder becomes a .glb with skull, face and dowels; for '{}' name one of its "
        "files: face.ply, depth.ply, implicit.ply or face.hspline.json",
        folder.string(), options.extension));
  }
  return RunGlb(folder);
}

std::string MeshBytes(const fs::path& file, const ExportOptions& options) {
  RefuseChord(file, options);
  return EncodeCarriedMesh(ReadCarriedMesh(file), LowerCase(options.extension),
                           file.stem().string());
}

}  // namespace

std::string ExportedBytes(const fs::path& from, const ExportOptions& options) {
  static const std::set<std::string> kMeshes = {".ply", ".obj", ".off", ".stl"};
  if (fs::is_directory(from)) {
    return RunBytes(from, options);
  }
  if (kMeshes.contains(LowerCase(from.extension().string()))) {
    return MeshBytes(from, options);
  }
  return EncodeFace(ReadHSpline(from), options.extension, options.chord_mm, options.threads);
}

}  // namespace semblance
