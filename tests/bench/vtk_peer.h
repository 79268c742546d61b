// SPDX-License-Identifier: GPL-3.0-or-later
// How VTK polygonises a field: vtkSampleFunction asks it at every corner of a grid, and
// vtkFlyingEdges3D makes triangles of the samples.
#pragma once

#include "surfaces/marching/polygonize.h"

namespace semblance::bench {
using namespace problems;

// How many triangles the surface of the field's zeros has.
std::size_t TrianglesByVtk(const ScalarField& field, const SampleGrid& grid);

}  // namespace semblance::bench
