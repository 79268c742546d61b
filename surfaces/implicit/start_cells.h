// SPDX-License-Identifier: GPL-3.0-or-later
// The grid around a shell and its depths, and the cells of it from which the outermost surface is
// followed.
#pragma once

#include <span>
#include <vector>

#include "surfaces/marching/polygonize.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// A cubic grid of `resolution` cells along the longest side of the shell with its greatest depth,
// and `margin` times the depth of room around.
SampleGrid GridAround(const TriMesh& shell, double depth_mm, int resolution, double margin);

// Goes outward from six points of the shell, each the furthest one along an axis that has a depth,
// and appends the cell of the last crossing. False if the field is positive up to the grid's end,
// which means that the surface leaves the grid.
bool FindStartCells(const TriMesh& shell, std::span<const double> depth_mm,
                    const ScalarField& field, const SampleGrid& grid,
                    std::vector<StartCell>& starts);

}  // namespace semblance
