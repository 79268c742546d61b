// SPDX-License-Identifier: GPL-3.0-or-later
// The mean skull of a population with its modes: the reference for skulls when no other is given.
// configs/mean_skull/README.md states its source, its licence and the commands that build it.
#pragma once

#include <span>
#include <vector>

#include "problems/subject/propose/reference_head.h"

namespace semblance::problems {

struct MeanSkull {
  ReferenceHead head;  // in the average skull's frame; symmetric
  // Per mode the displacement of each vertex in mm. Over the population, the coefficients have the
  // mean 0 and the variance 1, and are uncorrelated.
  std::vector<std::vector<Vec3>> modes;
};

// Reads the files of configs/mean_skull, whose text is part of the program.
MeanSkull ReadMeanSkull();

// The mean skull as its modes shape it for one subject.
struct AdaptedSkull {
  ReferenceHead head;  // in the mean skull's frame
  Similarity skull_from_head;
};

// Fits pose, size and coefficients to the subject's shell, from a nearly right start. Each round
// matches points of the model with the closest bone that faces alike, within a reach that shrinks,
// and minimises the squared distances along the normals plus the squared coefficients. `known`:
// sites of the subject that a person has placed; they count as points without sliding.
AdaptedSkull AdaptMeanSkull(const MeanSkull& mean, const SkullShell& skull, const Similarity& start,
                            std::span<const SitePoint> known);

}  // namespace semblance::problems
