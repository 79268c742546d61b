// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a volume, and what is taken from it, can be a head's in millimetres.
#pragma once

#include <string>

#include "problems/volumes/ct_volume.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// Both throw InputError where no head is so small: the file's lengths are in another unit, which
// is named, and its header has to be corrected. A volume may be larger than any head.
void CheckHeadFits(const CtVolume& volume);
void CheckIsNotTooSmall(const TriMesh& mesh, const std::string& name);

}  // namespace semblance
