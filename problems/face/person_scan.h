// SPDX-License-Identifier: GPL-3.0-or-later
// A CT scan of a made-up person.
#pragma once

#include "problems/face/person_phantom.h"
#include "problems/io/volumes/ct_volume.h"
#include "problems/subject/phantom_ct.h"

namespace semblance::problems {

// A CT scan of the person (phantom_ct.h). Bone is a layer of options.bone_mm under the skull's
// surface. That surface ends at crown and back; there the bone is a layer of the same thickness
// under the scalp.
CtVolume VoxelisePerson(const PersonPhantom& person, const PhantomCtOptions& options);

}  // namespace semblance::problems
