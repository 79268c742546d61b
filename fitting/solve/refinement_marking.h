// SPDX-License-Identifier: GPL-3.0-or-later
// Where an adaptive fit takes finer vertices.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/space/hierarchical_spline_space.h"

namespace semblance {

// Where a leaf of the measured space has a point farther off than the plan's tolerance there: the
// vertices over its coarsest ancestor (or itself) that is not wholly overlaid yet; and over the
// patches beside that one which hold plainly fewer points, for where detail ends at the edge of a
// gap, coarse vertices take its place and swing. Sorted; none are edited.
//   squares: |e|^2 of each point of the cloud, mm^2; needed where the plan has regions.
//   places: (u,v) over which finer vertices are needed however few points are there.
std::vector<VertexId> MarkForRefinement(const HierarchicalSplineSpace& space,
                                        const AdaptivePlan& plan, const PointCloud& cloud,
                                        std::span<const double> squares,
                                        std::span<const Vec2> places = {});

}  // namespace semblance
