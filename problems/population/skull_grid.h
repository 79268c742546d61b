// SPDX-License-Identifier: GPL-3.0-or-later
// One parametrisation for all skulls: the generic face's (u,v), laid on the bone.
#pragma once

#include <vector>

#include "problems/population/population_file.h"

namespace semblance {

// Per cell of the grid, i + columns j.
struct SkullGrid {
  std::vector<Vec2> uv;
  std::vector<Vec3> bone;        // on the skull, mm; NaN where none belongs to the cell
  std::vector<Vec3> normals;     // unit, out of the bone; zero where there is none
  std::vector<Vec3> in_average;  // `bone` in the frame of the average skull (average_skull.h)
};

// The generic head is bent by a thin plate so that its sites lie on the skull's landmarks
// (template_placement.h); each cell's middle then goes to the bone that belongs to it
// (skin_distance.h), within reach_mm. So cells of one (u,v) correspond at the sites, and between
// them as the plate lets them. The normal is the mean of the skull's, by area, within
// normal_radius_mm. skull: what is seen of it from outside. Throws InputError if there are fewer
// than four landmarks of standard sites, or all in a plane.
SkullGrid LayGrid(const TriMesh& skull, const LandmarkFile& landmarks, const DenseOptions& options,
                  const RunContext& context);

}  // namespace semblance
