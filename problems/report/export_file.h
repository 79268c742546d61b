// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance export`: the results of a run as files for other programs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace semblance::problems {

struct ExportOptions {
  std::string extension;           // of the wanted file, in upper or lower case
  std::optional<double> chord_mm;  // chord error of an H-spline's triangles; empty: EncodeFace's
  int threads = 1;
};

// The bytes of the exported file. `from` decides the kind:
// - An H-spline (.json) becomes a file of EncodeFace (face_export.h).
// - A mesh (.ply .obj .off .stl) becomes a mesh of another format. The formats .vtp, .vtu and .ply
//   keep all values of a PLY's vertices, .glb keeps colours and normals, .obj, .off and .stl keep
//   the shape alone.
// - The folder of a run becomes a .glb in metres, +y up, with the nodes `skull` (simplified, from
//   scene.json), `face` (face.ply with the colours of its values) and `dowels`, with one child
//   `dowel SITE` per dowel: a rod from bone to tip.
// Throws InputError for an extension or a chord error that does not fit the kind, and IoError if a
// file is missing or is not that of a run.
std::string ExportedBytes(const std::filesystem::path& from, const ExportOptions& options);

}  // namespace semblance::problems
