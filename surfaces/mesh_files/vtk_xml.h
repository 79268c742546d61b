// SPDX-License-Identifier: GPL-3.0-or-later
// Writes meshes with values per vertex as VTK XML, which ParaView and 3D Slicer open with all
// values.
#pragma once

#include <string>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance::surfaces {

// Writes .vtp (vtkPolyData) and .vtu (vtkUnstructuredGrid, which meshio reads too). Coordinates and
// values are doubles in Base64, so that no digit is lost, and NaN if there is no data. Normals
// become the array "Normals", colours "RGB". A scalar loses the prefix "scalar_", which other
// programs need in a PLY. "quality" is left out if it repeats another scalar, as it does in every
// PLY of this program. The first scalar is the active one. Characters that XML or VTK cannot hold
// in a name become
// '_', and repeated names get a number. Throws InputError as CheckAttributes does.
std::string EncodeVtp(const TriMesh& mesh, const MeshAttributes& attributes);
std::string EncodeVtu(const TriMesh& mesh, const MeshAttributes& attributes);

}  // namespace semblance::surfaces
