// SPDX-License-Identifier: GPL-3.0-or-later
// Checks whether the values and sizes of a CT volume can be those of a head.
#pragma once

#include <string>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "problems/io/volumes/head_mask.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// The most frequent values of air and of what lies in it.
struct GreyLevels {
  double air = kNaN;
  double tissue = kNaN;
  double tissue_share = kNaN;  // voxels near `tissue` among all denser than air; small for bone
};

// Finds the levels in the histogram of the ellipse that fits into each slice, because many scanners
// fill the corners with another value. NaN for an absent level.
GreyLevels FindGreyLevels(const CtVolume& volume);

// Air has -1000 HU and soft tissue about 0 to 100. Throws InputError, naming the shift or factor of
// the values, if the thresholds of skin and bone do not suit the levels; notes levels that are odd.
void CheckHounsfieldUnits(const CtVolume& volume, double skin_hu, double bone_hu,
                          std::vector<std::string>& notes);

// Checks the width and length of the head near its top, and its height if it is whole. Notes sizes
// that no head has, with the spacing that would cause them, and throws InputError if they are far
// from that. Also notes or refuses a head that reaches most sides of the volume.
void CheckHeadExtent(const CtVolume& volume, const HeadMask& mask, const TriMesh& skin,
                     std::vector<std::string>& notes);

}  // namespace semblance::problems
