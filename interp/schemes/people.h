// SPDX-License-Identifier: GPL-3.0-or-later
// People's distribution of tissue depth all over the facial bone, and how it is carried onto one
// skull.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "interp/dowels/depth_input.h"
#include "surfaces/base/geometry.h"

namespace semblance::interp {

// The distribution of the logarithm of depth (mm) over people: mean + sd * (loading * build +
// sqrt(1 - loading^2) * rest), where build is a person's number and rest varies over the bone; both
// have the mean 0 and the variance 1.
struct LogDepth {
  double mean = kNaN;
  double sd = kNaN;       // > 0
  double loading = kNaN;  // -1..1
};

struct PeoplePoint {
  Vec3 position = Vec3::Constant(kNaN);  // mm
  Vec3 normal = Vec3::Constant(kNaN);    // unit, out of the bone
  LogDepth depth;
};

// Points of the mean facial bone.
struct People {
  std::vector<PeoplePoint> bone;
  std::map<std::string, PeoplePoint> sites;  // by site code
};

// Reads a CSV with the columns site (empty for a point between the sites), x_mm, y_mm, z_mm,
// normal_x, normal_y, normal_z, log_mean, log_sd, loading. name: for messages. Throws IoError
// "name:line: what" for a row that is not such a point.
People ReadPeople(std::string_view csv, std::string_view name);

// The distribution of 54 adults that the program carries (configs/people/depth.csv).
const People& CarriedPeople();

// A point of the mean bone on one subject's skull. The depth of `depth` counts from the bone, and
// `on_skull` lies gap_mm outside it where the skull was filled, as over the temporal fossa.
struct SubjectPoint {
  Vec3 on_skull = Vec3::Constant(kNaN);  // mm
  Vec3 normal = Vec3::Constant(kNaN);    // unit
  LogDepth depth;
  double gap_mm = 0;
};

// People's points on a subject, or why there are none.
struct CarriedBone {
  std::vector<SubjectPoint> points;
  std::map<std::string, Vec3> sites;  // on the bone, by site code; those that find bone
  std::string fault;                  // empty if there are points
};

// Carries the mean bone onto input.bone (input.skull without it): by a thin plate through the sites
// of the dowels, then along smooth displacements towards the closest bone that faces the same way.
// Points with no such bone within a few mm are left out. The fault is that fewer than six dowels
// stand at sites of the people, that these lie in a plane, or that less than a quarter of the
// points find bone.
CarriedBone CarryToSubject(const People& people, const DepthInput& input, const RunContext& run);

}  // namespace semblance::interp
