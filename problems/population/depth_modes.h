// SPDX-License-Identifier: GPL-3.0-or-later
// Depth all over the skull, over a population: its mean, its spread, and how it varies together.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "problems/population/population_file.h"
#include "problems/population/subject_depths.h"

namespace semblance {

// Per cell of the grid, i + columns j. NaN where no subject (for an sd: fewer than two) has it.
struct DepthModes {
  int columns = 0, rows = 0;
  std::vector<int> n;  // subjects with a depth there
  std::vector<double> mean_mm, sd_mm;
  std::vector<Vec3> bone;  // mean place, in the frame of the average skull, mm
  std::vector<bool> used;  // by the modes: enough subjects have it
  // Of each mode the change of depth at one standard deviation; NaN where not used.
  std::vector<std::vector<double>> modes_mm;
  std::vector<double> share;  // of the variance over the used cells, per mode
  Eigen::MatrixXd scores;     // subjects x modes, in standard deviations
};

// Principal components over the cells that at least least_share of the subjects have, each cell
// alike; depths that are missing there are found with them, by turns, from the mean on
// (probabilistic principal components' limit without noise; Ilin & Raiko 2010). A mode thickens
// more than it thins. At most one mode fewer than subjects. The subjects have one grid.
DepthModes FindModes(std::span<const DenseDepths> subjects, const DenseOptions& options);

}  // namespace semblance
