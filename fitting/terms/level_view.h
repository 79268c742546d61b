// SPDX-License-Identifier: GPL-3.0-or-later
// A level of a whole surface as the problem that its solve sees.
#pragma once

#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/problem/fit_target.h"
#include "surfaces/hspline/control_net.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// One point that the level should meet: its plain B-spline at uv is to be `position`.
struct Observation {
  Vec2 uv = Vec2::Constant(kNaN);        // in [0,1] x [0,1]
  Vec3 position = Vec3::Constant(kNaN);  // mm
  double weight = 1;                     // > 0, relative to the other points
  bool landmark = false;                 // a standard one, for LandmarkTerm
};

// A point whose foot on the bone is known; all less what finer levels add to it.
struct BoneObservation {
  Observation point;
  Vec3 foot = Vec3::Constant(kNaN);       // mm
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
};

// All that the terms may look at.
struct LevelView {
  PatchGrid grid;
  ControlNet start;                        // before the solve
  ControlNet rest;                         // the template's net of this level; same size
  Vec2 lengths_mm = Vec2::Constant(kNaN);  // what [0,1] stands for along u and v, MeanLengths of
                                           // the template; > 0
  std::vector<Observation> observations;
  std::vector<BoneObservation> bone = {};
  std::vector<int> held = {};  // vertices that a PriorTerm with held_only looks at, each once

  double WeightSum() const;  // of the observations
  double LandmarkWeightSum() const;
};

// The level as it stands, with the points of the target in their order; what finer levels add at a
// point is taken off it. rest: the placed template, of the same shape. Throws InputError for a
// level that the surface does not have, another shape, or a target as CheckTarget.
LevelView ViewOfLevel(const HSplineSurface& surface, const HSplineSurface& rest,
                      const FitTarget& target, int level);

}  // namespace semblance
