// SPDX-License-Identifier: GPL-3.0-or-later
// A phantom's sites as the landmarks that people would place on its skull.
#pragma once

#include <cstdint>

#include "problems/subject/landmarks.h"
#include "problems/subject/phantom.h"

namespace semblance {

// All sites, with their exact normals and the depths along them. random_seed: for the name.
LandmarkFile PhantomLandmarks(const Phantom& phantom, std::uint64_t random_seed);

}  // namespace semblance
