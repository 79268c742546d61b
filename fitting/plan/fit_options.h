// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit is asked for.
#pragma once

#include <vector>

#include "fitting/problem/feature_rule.h"
#include "fitting/problem/fit_schedule.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/terms/term.h"

namespace semblance {

struct FitOptions {
  SchedulePlan plan = ListedPlan{};  // which levels are solved, in which order
  std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{}, MembraneTerm{}};  // of each solve
  FeatureRule features = RestoreFeatures{};  // of eyes, nose, mouth
  Relaxation relaxation = NoRelaxation{};    // whether and how the points' (u,v) move
  Solver solver = Solver::kCeres;            // how a solve finds its minimum
};
template <class Visitor>
void Fields(Visitor& visit, FitOptions& o) {
  visit(FieldInfo{.name = "plan",
                  .doc = "listed: the steps of a schedule once; coarse_to_fine: level by level; "
                         "until: a schedule again and again while that helps; adaptive: all levels "
                         "at once, finer vertices only where they are needed; auto: levels, "
                         "smoothness and outliers from the points"},
        o.plan);
  visit(FieldInfo{.name = "terms", .min = 1, .doc = "what each solve weighs"}, o.terms);
  visit(FieldInfo{.name = "features",
                  .doc = "what the fit may do to the offsets that make eyes, nose and mouth; "
                         "restore: fit them as any, then give them back the template's (thesis "
                         "4.3); free: they keep what the fit gave; weighted: they resist it; "
                         "frozen: they do not take part, and the fit makes do with the others"},
        o.features);
  visit(
      FieldInfo{.name = "relaxation",
                .doc = "whether and how the points' (u,v) move over the surface; none: they stay; "
                       "footpoint: after each step of the schedule towards the nearest point of "
                       "the surface; alternating: against their neighbours' pull too, and the "
                       "level is fitted again after each round; tangent_distance: alternating, "
                       "then fits in which the points may slide along the surface; joint: each "
                       "round moves (u,v) and vertices in one problem, then fits the level"},
      o.relaxation);
  visit(
      FieldInfo{.name = "solver",
                .doc = "ceres: each solve of any plan is a ceres::Problem whose parameter blocks "
                       "are the control vertices; where the terms treat x, y and z alike, one "
                       "coordinate of 3 x 3 of them; fastest: one direct factorisation of the same "
                       "least squares where the terms are linear, or a loss is on terms that treat "
                       "x, y and z alike; else as ceres. The same surface to rounding. The auto "
                       "plan goes by conjugate gradients; with ceres a last "
                       "problem over the vertices that it found brings all terms to their minimum"},
      o.solver);
}

}  // namespace semblance
