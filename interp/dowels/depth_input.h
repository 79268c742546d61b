// SPDX-License-Identifier: GPL-3.0-or-later
// What every depth scheme and outside rule is given, and the small things they share.
#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "interp/dowels/depth_field.h"
#include "interp/dowels/dowel.h"
#include "interp/dowels/dowel_network.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct DepthInput {
  const TriMesh& skull;
  std::span<const Vec3> normals;  // unit, out of the bone, one per vertex; zero where there is none
  std::span<const Dowel> dowels;
  const DowelNetwork& network;  // may have no area where the scheme needs none
  // What is to be expected before any measurement, e.g. a population's mean depths at its sites: as
  // dowels on this skull, also where no depth was measured. None where nothing is known.
  std::span<const Dowel> expected = {};
};

// Throws InputError if there is no dowel, if one (also an expected one) has no finite base, no unit
// direction or no depth above 0, if the normals are not one per vertex, if an area names a dowel
// that is not there, or if a vertex is not finite.
void CheckDepthInput(const DepthInput& input);

// One entry per vertex: no depth, outside.
DepthField EmptyDepthField(std::size_t vertices);

// body(i) for each vertex on run.threads threads; as ParallelFor. Throws Cancelled if stopped.
void ForEachVertex(const DepthInput& input, const RunContext& run,
                   const std::function<void(std::size_t)>& body);

// Is the angle between the normal and the direction below max_angle_deg? At 180 every vertex faces,
// also one without a normal; below, such a vertex counts as turned by 90.
bool Faces(const Vec3& normal, const Vec3& direction, double max_angle_deg);

// The facing option: alike for all schemes that have it.
template <class Visitor>
void MaxAngleField(Visitor& visit, double& max_angle_deg) {
  visit(FieldInfo{.name = "max_angle_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 180,
                  .doc = "bone turned further than this from its dowels' mean direction gets no "
                         "depth of theirs (inner table, orbit walls); 180 switches the test off"},
        max_angle_deg);
}

}  // namespace semblance
