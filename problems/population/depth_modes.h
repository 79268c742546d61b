// SPDX-License-Identifier: GPL-3.0-or-later
// Depth over the whole skull in a population: mean, spread and modes of variation, and the grid as
// a mesh for viewing.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/subject_depths.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// Values per cell i + columns j of the grid. A value is NaN if no subject has the cell; an sd needs
// two subjects.
struct DepthModes {
  int columns = 0, rows = 0;
  std::vector<int> n;  // subjects with a depth there
  std::vector<double> mean_mm, sd_mm;
  std::vector<Vec3> bone;  // mean position in the frame of the average skull, mm
  std::vector<bool> used;  // true if enough subjects have the cell, so that the modes use it
  // The change of depth at one standard deviation, per mode and cell; NaN in unused cells.
  std::vector<std::vector<double>> modes_mm;
  std::vector<double> share;  // fraction of the variance over the used cells, per mode
  Eigen::MatrixXd scores;     // subjects x modes, in standard deviations
};

// Finds the principal components of depth over the cells that at least least_share of the subjects
// have, with equal weights. Missing depths in these cells start at the mean and are estimated in
// turns with the components (the limit of probabilistic principal components without noise; Ilin &
// Raiko 2010). The sign of a mode is such that it thickens more than it thins. There is at most one
// mode fewer than subjects. All subjects must have the same grid.
DepthModes FindModes(std::span<const DenseDepths> subjects, const DenseOptions& options);

// A mesh through the mean positions of the cells that any subject has, in the frame of the average
// skull.
struct DenseMesh {
  TriMesh mesh;
  std::vector<std::size_t> cells;  // the cell of each vertex
};
DenseMesh MakeDenseMesh(const DepthModes& dense);

// The value of its cell at each vertex.
std::vector<double> OnVertices(const DenseMesh& mesh, const std::vector<double>& by_cell);

}  // namespace semblance::problems
