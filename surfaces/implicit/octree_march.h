// SPDX-License-Identifier: GPL-3.0-or-later
// Marching cubes guided by an octree of emitters (thesis 3.2.2, 3.2.3). For polygonizer.cc alone.
#pragma once

#include "surfaces/implicit/polygonizer.h"

namespace semblance {

PolygonizeResult MarchOctree(const McOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context);
PolygonizeResult MarchOctree(const MinMaxOctree& octree, const ImplicitSurface& surface,
                             const SampleGrid& grid, const EdgeSearchOptions& options,
                             const RunContext& context);

}  // namespace semblance
