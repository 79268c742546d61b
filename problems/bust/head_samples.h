// SPDX-License-Identifier: GPL-3.0-or-later
// Points of a laid out head on a regular grid of its domain.
#pragma once

#include <vector>

#include "problems/bust/head_domain.h"

namespace semblance {

struct HeadSamples {
  std::vector<Vec3> points;  // mm
  std::vector<Vec2> uv;
};

// One for each (k / columns, m / rows), m = 0..rows, that a triangle covers. Between its corners a
// triangle is curved so that it meets their normals (PN triangles, Vlachos et al. 2001).
HeadSamples SampleHead(const HeadDomain& head, int columns, int rows);

}  // namespace semblance
