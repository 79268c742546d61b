// SPDX-License-Identifier: GPL-3.0-or-later
// A dense map of depth from a file, in place of a scheme.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "interp/dowels/depth_input.h"

namespace semblance::interp {

struct DepthMap {
  static constexpr std::string_view kName = "depth_map";
  std::filesystem::path file = {};
  std::string scalar = "scalar_depth_mm";
  std::filesystem::path mesh = {};
  double reach_mm = 3;
};
template <class Visitor>
void Fields(Visitor& visit, DepthMap& o) {
  visit(
      FieldInfo{.name = "file",
                .doc =
                    "depth per vertex: a PLY whose vertices have the scalar, e.g. depth.ply "
                    "of a run, or a CSV with the scalar's name in its first line and a line "
                    "per vertex; above 0, or nan for no depth. In a study {subject} stands for the "
                    "subject's name, e.g. maps/{subject}.ply"},
      o.file);
  visit(FieldInfo{.name = "scalar", .doc = "name of the PLY's vertex property or the CSV's column"},
        o.scalar);
  visit(FieldInfo{.name = "mesh",
                  .doc = "mesh whose vertices belong to a CSV's lines; empty: the skull itself "
                         "(after `fill`). Not for a PLY, which is a mesh itself"},
        o.mesh);
  visit(FieldInfo{.name = "reach_mm",
                  .unit = "mm",
                  .min = 0.001,
                  .max = 100,
                  .doc = "vertices further than this from the map's mesh get no depth"},
        o.reach_mm);
}
template <class Report>
void CheckValue(Report& report, const DepthMap& o) {
  if (o.file.empty()) {
    report("file",
           "no file is named; give a PLY or CSV with a depth per vertex, in a study e.g. "
           "maps/{subject}.ply");
  }
}

// Gives each vertex the map's depth at the closest point of its mesh, linear in the triangle. The
// dowels have no influence. No sd_mm. kOutside if the mesh is further than reach_mm or a corner
// with a weight has no depth; never kNotFacing. Throws InputError as CheckDepthInput does, if no
// file is named, if there is not one depth per vertex of the mesh, and if a depth is infinite or
// not above 0 (with its index); IoError if a file cannot be read.
DepthField InterpolateDepth(const DepthMap& options, const DepthInput& input,
                            const RunContext& run);

}  // namespace semblance::interp
