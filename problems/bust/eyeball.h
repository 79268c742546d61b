// SPDX-License-Identifier: GPL-3.0-or-later
// The eye by formula: a sphere with a slightly steeper cornea, an iris and a pupil.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// A piece of one colour.
struct EyePart {
  std::string name;                   // sclera, limbus, iris, pupil
  std::array<double, 3> colour = {};  // sRGB, 0..1; says nothing of the person
  TriMesh mesh;
};

// The front of the eye. gaze: unit, to where it looks; up: not parallel to it. Iris and pupil have
// radii of 5.9 mm (Ruefer et al. 2005) and 1.9 mm, whatever the size of the ball.
std::vector<EyePart> EyeParts(const Sphere& ball, const Vec3& gaze, const Vec3& up);

// The sphere of least squares through points; needs four that are not on a circle.
Sphere SphereThrough(std::span<const Vec3> points);

}  // namespace semblance
