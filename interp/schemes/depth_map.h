// SPDX-License-Identifier: GPL-3.0-or-later
// A dense map of depth, measured or made elsewhere, in place of a scheme.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance {

struct DepthMap {
  static constexpr std::string_view kName = "depth_map";
  std::filesystem::path file = {};         // PLY or CSV
  std::string scalar = "scalar_depth_mm";  // the property or column
  std::filesystem::path mesh = {};         // of a CSV; empty: the skull
  double reach_mm = 3;                     // skull further off gets no depth
};
template <class Visitor>
void Fields(Visitor& visit, DepthMap& o) {
  visit(
      FieldInfo{.name = "file",
                .doc = "depth per vertex: a PLY whose vertices have the scalar, e.g. depth.ply of "
                       "a run, or a CSV with the scalar's name in its first line and a line "
                       "per vertex; above 0, or nan where there is none"},
      o.file);
  visit(FieldInfo{.name = "scalar", .doc = "name of the PLY's vertex property or the CSV's column"},
        o.scalar);
  visit(FieldInfo{.name = "mesh",
                  .doc = "mesh whose vertices a CSV's lines are; empty: those of the skull itself "
                         "(after `fill`), as many as there are lines. Not for a PLY, which is one"},
        o.mesh);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 0.001,
                  .max = 100,
                  .doc = "skull further than this from the map's mesh gets no depth of it"},
        o.reach_mm);
}

// At each vertex the map at the closest point of its mesh, linear between the corners of the
// triangle. The dowels have no say; depths are the map's, so outside the dowels' range too. No
// sd_mm. kOutside where the mesh is further than reach_mm or a corner that counts has no depth;
// never kNotFacing. Throws InputError as CheckDepthInput, if no file is named, if the count is not
// that of the mesh, and if a depth is infinite or not above 0 (saying which); IoError if a file
// cannot be read.
DepthField InterpolateDepth(const DepthMap& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance
