// SPDX-License-Identifier: GPL-3.0-or-later
// The order of a series' slices in space, and whether they make a regular volume.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

struct StackOptions {
  // Missing slices are to be interpolated, and of doubled ones the first is to be taken; else both
  // are errors.
  bool fill = false;
  double longest_fill_mm = 10;  // between the slices on either side of a gap
};

// Slices at equal distances along the normal, lowest first.
struct SliceStack {
  std::vector<int> slices;             // number of the slice given; -1: missing
  Vec3 origin = Vec3::Constant(kNaN);  // of the first
  Vec3 step = Vec3::Constant(kNaN);    // from a slice to the next; aslant if the gantry was tilted
  std::vector<std::string> notes;
};

// positions: of the slices' first voxels, LPS, mm. normal: of all slices, unit. names: what the
// slices are called in messages. Throws InputError, naming `where` and the positions along the
// normal, for fewer than 2 slices, doubled or missing ones (unless filled), distances that are not
// multiples of one, and slices that lie aside of the others.
SliceStack StackSlices(std::span<const Vec3> positions, const Vec3& normal,
                       std::span<const std::string> names, const StackOptions& options,
                       const std::string& where);

// The angle between the stack's step and the slices' normal, deg; 0 without gantry tilt.
double TiltDeg(const SliceStack& stack, const Vec3& normal);

}  // namespace semblance
