// SPDX-License-Identifier: GPL-3.0-or-later
// Marking: the choice of finer vertices in an adaptive fit.
//
// It is one step of the refinement cycle (hierarchical_spline_space.h):
//
//   requires    a measured space; `squares` if the plan has regions
//   guarantees  sorted vertices of levels 1 .. plan.finest, none of which is edited yet
//   then        HierarchicalSplineSpace::Edit(vertices) and a further solve; an empty result ends
//               the cycle
//
// Each cycle overlays a patch by one level at most, and levels are bounded by plan.finest, so the
// cycle ends.
#pragma once

#include <span>
#include <vector>

#include "fitting/problem/fit_schedule.h"
#include "fitting/space/hierarchical_spline_space.h"

namespace semblance::fitting {

// Marks vertices over each leaf with a point farther away than the plan's tolerance, and over each
// leaf with one of `places`. They are the missing vertices over the leaf's coarsest ancestor (or
// the leaf itself) that is not fully overlaid yet. The neighbours of that patch with much fewer
// points are overlaid too: at the edge of a gap, coarse vertices would otherwise take over from the
// detail and oscillate.
//   squares: |e|^2 of each point of the cloud, mm^2; needed only if the plan has regions.
//   places: (u,v) that need finer vertices, regardless of the number of points there.
std::vector<VertexId> MarkForRefinement(const HierarchicalSplineSpace& space,
                                        const AdaptivePlan& plan, const PointCloud& cloud,
                                        std::span<const double> squares,
                                        std::span<const Vec2> places = {});

}  // namespace semblance::fitting
