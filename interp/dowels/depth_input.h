// SPDX-License-Identifier: GPL-3.0-or-later
// The input and the output of every depth scheme and outside rule.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "interp/dowels/dowel.h"
#include "interp/dowels/dowel_network.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::interp {

enum class DepthStatus : std::uint8_t {
  kAssigned,   // the scheme assigned a depth
  kOutside,    // in no dowel area; a finite depth comes from the outside rule
  kNotFacing,  // in an area, but the bone faces away from the area's dowels (inner table, far side)
};

// The weight of one scheme in an average of several.
struct SchemeShare {
  std::string scheme;
  double weight = kNaN;  // 0..1
};

// The parameters of a scheme's Gaussian process, from its likelihood or fixed by the options.
struct DepthProcess {
  double length_mm = kNaN;  // correlation length
  double signal_mm = kNaN;  // standard deviation
  double nugget_mm = kNaN;  // common nugget besides the dowels' own; 0 if none is fitted
  double mean_mm = kNaN;    // generalised least squares mean, averaged over the dowels
  std::vector<std::string> at_end = {};  // one sentence per parameter that ended at a bound of its
                                         // range
};

// Tissue depth at every vertex of a skull; depth_mm, status and sd_mm have one entry per vertex.
struct DepthField {
  std::vector<double> depth_mm;  // NaN if unknown; such a vertex does not emit
  std::vector<DepthStatus> status;
  std::vector<double> sd_mm;                 // NaN if the scheme states none
  std::vector<SchemeShare> shares = {};      // sum 1; empty for a single scheme
  std::optional<DepthProcess> process = {};  // set by schemes that are Gaussian processes
  std::vector<std::string> notes = {};       // what a person should know of it
};

struct DepthInput {
  const TriMesh& skull;
  std::span<const Vec3> normals;  // unit, out of the bone, one per vertex; zero if unknown
  std::span<const Dowel> dowels;
  const DowelNetwork& network;  // may be empty if the scheme needs no area
  // Depths that are expected before any measurement, such as a population's mean depths at its
  // sites. They are dowels on this skull, also at sites without a measured depth. May be empty.
  std::span<const Dowel> expected = {};
  // The bone that `skull` was filled from, or null if `skull` is the bone itself.
  const TriMesh* bone = nullptr;
};

// Throws InputError if there is no dowel; if a dowel (also an expected one) lacks a finite base, a
// unit direction or a depth above 0; if there is not one normal per vertex; if an area names a
// missing dowel; or if a vertex is not finite.
void CheckDepthInput(const DepthInput& input);

// Makes a field without depths, with status kOutside at each vertex.
DepthField EmptyDepthField(std::size_t vertices);

// Calls body(i) for each vertex on run.threads threads, like ParallelFor. Throws Cancelled if
// stopped.
void ForEachVertex(const DepthInput& input, const RunContext& run,
                   const std::function<void(std::size_t)>& body);

// Returns true if the angle between normal and direction is below max_angle_deg. At 180 the result
// is always true. Below 180 a zero normal counts as turned by 90 degrees.
bool Faces(const Vec3& normal, const Vec3& direction, double max_angle_deg);

// The common option of all schemes with a test of facing.
template <class Visitor>
void MaxAngleField(Visitor& visit, double& max_angle_deg) {
  visit(FieldInfo{.name = "max_angle_deg",
                  .unit = "deg",
                  .min = 0,
                  .max = 180,
                  .doc = "bone turned further than this from its dowels' mean direction gets no "
                         "depth from them (inner table, orbit walls); 180 switches the test off"},
        max_angle_deg);
}

}  // namespace semblance::interp
