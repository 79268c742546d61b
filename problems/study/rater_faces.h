// SPDX-License-Identifier: GPL-3.0-or-later
// The pictures that raters compare.
#pragma once

#include <filesystem>
#include <string>

#include "problems/report/pictures/image.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// A person's recovered face and true skin with nasion at the origin and the axes of an average
// skull: +x left, +y back, +z up; mm.
struct RaterFace {
  std::string person;  // name of the run's folder
  TriMesh recovered, skin;
};

// Reads scene.json and dowels.csv of a run. Throws IoError if the run has no recovered face or no
// true skin, or fewer than three standard sites.
RaterFace ReadRaterFace(const std::filesystem::path& run);

// The face from the front and from 40 degrees to its left, cut at one distance from nasion for all
// faces, in one scale, and turned by up to 4 degrees about each axis.
Image DrawRaterFace(const TriMesh& face, Random& random, int threads);

}  // namespace semblance::problems
