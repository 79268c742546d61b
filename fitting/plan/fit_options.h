// SPDX-License-Identifier: GPL-3.0-or-later
// The options of a fit.
#pragma once

#include <vector>

#include "fitting/problem/feature_rule.h"
#include "fitting/problem/fit_schedule.h"
#include "fitting/relaxation/relaxation.h"
#include "fitting/terms/term.h"

namespace semblance::fitting {

struct FitOptions {
  SchedulePlan plan = ListedPlan{};
  std::vector<Term> terms = {PointTerm{}, SmoothnessTerm{}, MembraneTerm{}};
  FeatureRule features = RestoreFeatures{};
  Relaxation relaxation = NoRelaxation{};
  Solver solver = Solver::kCeres;
};
template <class Visitor>
void Fields(Visitor& visit, FitOptions& o) {
  visit(FieldInfo{.name = "plan",
                  .doc = "order of the levels; listed: the steps of a schedule once; "
                         "coarse_to_fine: level by level; until: a schedule again and again while "
                         "that helps; adaptive: all levels at once, finer vertices only where they "
                         "are needed; auto: levels, smoothness and outliers from the points"},
        o.plan);
  visit(
      FieldInfo{.name = "terms", .min = 1, .doc = "terms of the cost that each solve makes least"},
      o.terms);
  visit(FieldInfo{.name = "features",
                  .doc = "treatment of the offsets that make eyes, nose and mouth; restore: they "
                         "are fitted, then get the template's offsets back (thesis 4.3); free: "
                         "they keep the fitted offsets; weighted: they resist the fit; frozen: "
                         "they keep the template's offsets, and only the others are fitted"},
        o.features);
  visit(
      FieldInfo{.name = "relaxation",
                .doc = "moves of the points' (u,v) over the surface; none: they stay; footpoint: "
                       "after each step of the schedule they move towards the nearest point of the "
                       "surface; alternating: so, but against the pull of their neighbours, and "
                       "the level is fitted again after each round; tangent_distance: alternating, "
                       "then fits in which the points may slide along the surface; joint: each "
                       "round moves (u,v) and vertices in one problem, then fits the level"},
      o.relaxation);
  visit(
      FieldInfo{.name = "solver",
                .doc = "ceres: each solve of any plan is a ceres::Problem whose parameter blocks "
                       "are the control vertices; where the terms treat x, y and z alike, one "
                       "coordinate of 3 x 3 of them; fastest: one direct factorisation of the same "
                       "least squares where the terms are linear, or a loss is on terms that treat "
                       "x, y and z alike; else as ceres. Level by level both give the same "
                       "surface to rounding; by the adaptive plan, whose solves before the "
                       "last are loose, the surfaces of one fit differed by 0.014 mm. The auto "
                       "plan uses conjugate gradients; with ceres a last problem over the vertices "
                       "that it found brings all terms to their minimum"},
      o.solver);
}

}  // namespace semblance::fitting
