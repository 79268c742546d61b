// SPDX-License-Identifier: GPL-3.0-or-later
// How VTK does what we do: it polygonises a field, finds closest points, and makes surfaces of a
// volume.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "surfaces/marching/polygonize.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::bench {
using namespace problems;

// vtkSampleFunction asks the field at every corner of the grid, and vtkFlyingEdges3D makes
// triangles of the samples. How many triangles the surface of the field's zeros has.
std::size_t TrianglesByVtk(const ScalarField& field, const SampleGrid& grid);

// The sum of the points' distances from the mesh in mm, by vtkStaticCellLocator.
double ClosestByVtk(const TriMesh& mesh, std::span<const Vec3> points);

// The triangles of a NIfTI volume's surfaces at these values, by vtkNIFTIImageReader and one pass
// of vtkFlyingEdges3D each.
std::size_t SurfacesByVtk(const std::string& volume, const std::vector<double>& values);

}  // namespace semblance::bench
