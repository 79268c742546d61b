// SPDX-License-Identifier: GPL-3.0-or-later
// `semblance export`: what a run has made, as a file of another program.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace semblance {

struct ExportOptions {
  std::string extension;           // of the file that is wanted, in any case
  std::optional<double> chord_mm;  // of an H-spline's triangles; empty: the default of EncodeFace
  int threads = 1;
};

// By what `from` is:
// - an H-spline (.json): EncodeFace (face_export.h);
// - a mesh (.ply .obj .off .stl): EncodeCarriedMesh, so that a .vtp, .vtu, .ply or .glb carries
//   what the vertices of a PLY carry;
// - the folder of a run: RunGlb, a .glb with skull, face and dowels.
// Throws InputError for an extension or a chord error that does not go with it, and as these.
std::string ExportedBytes(const std::filesystem::path& from, const ExportOptions& options);

}  // namespace semblance
