// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes with values per vertex in VTK's XML, which ParaView and 3D Slicer open with every value.
#pragma once

#include <string>

#include "surfaces/mesh/tri_mesh.h"
#include "surfaces/mesh_files/mesh_attributes.h"

namespace semblance {

// .vtp (vtkPolyData) and .vtu (vtkUnstructuredGrid, which meshio reads too). Coordinates and values
// in double precision as Base64, so that no digit is lost; NaN where there is no data. Normals
// become the array "Normals", colours "RGB". A scalar loses the prefix "scalar_" that other
// programs need in a PLY; "quality" is left out where it repeats another scalar, as in every PLY of
// this program. The first scalar is the active one. Characters of a name that XML or VTK cannot
// hold become '_', and names that are there twice are numbered. Throws InputError as
// CheckAttributes.
std::string EncodeVtp(const TriMesh& mesh, const MeshAttributes& attributes);
std::string EncodeVtu(const TriMesh& mesh, const MeshAttributes& attributes);

}  // namespace semblance
