// SPDX-License-Identifier: GPL-3.0-or-later
// Edits of an H-spline by hand: a list of vertices with new offsets, as a file, and its inverse.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// One vertex of one level. On level 0 the offset is added to the vertex, in world axes; on the
// others it replaces the vertex's offset from the coarser surface (thesis 4.1), and null takes it
// away.
struct VertexEdit {
  int level = 0;                                // of the vertex
  int i = 0;                                    // along u
  int j = 0;                                    // along v
  std::optional<std::array<double, 3>> offset;  // null: follows the coarser surface
};

// Takes all offsets of the levels in a part of the domain away, before the edits are made.
struct RegionReset {
  std::array<double, 2> u = {0, 1};  // lowest, highest; lowest > highest runs across the seam
  std::array<double, 2> v = {0, 1};  // lowest and highest
  int first_level = 1;               // coarsest that loses its detail
};

struct EditScript {
  std::vector<RegionReset> resets;  // done first
  std::vector<VertexEdit> edits;    // vertices with another offset
};

template <class Visitor>
void Fields(Visitor& visit, VertexEdit& o) {
  visit(FieldInfo{.name = "level", .min = 0, .max = 8, .doc = "of the vertex"}, o.level);
  visit(FieldInfo{.name = "i", .min = 0, .max = 10000, .doc = "of the vertex, along u"}, o.i);
  visit(FieldInfo{.name = "j", .min = 0, .max = 10000, .doc = "of the vertex, along v"}, o.j);
  visit(FieldInfo{.name = "offset",
                  .unit = "mm",
                  .min = -1000,
                  .max = 1000,
                  .doc = "from the coarser surface, in the surface's axes of reference (level 0: "
                         "added to the vertex, in world axes); null: follow the coarser surface"},
        o.offset);
}

template <class Visitor>
void Fields(Visitor& visit, RegionReset& o) {
  visit(FieldInfo{.name = "u", .min = 0, .max = 1, .doc = "lowest and highest u"}, o.u);
  visit(FieldInfo{.name = "v", .min = 0, .max = 1, .doc = "lowest and highest v"}, o.v);
  visit(FieldInfo{.name = "first_level",
                  .min = 1,
                  .max = 8,
                  .doc = "coarsest level that loses its detail; smaller smooths more"},
        o.first_level);
}

template <class Visitor>
void Fields(Visitor& visit, EditScript& o) {
  visit(FieldInfo{.name = "resets", .doc = "parts of the domain that lose their detail, first"},
        o.resets);
  visit(FieldInfo{.name = "edits", .doc = "vertices that get another offset"}, o.edits);
}

template <class Report>
void CheckValue(Report& report, const RegionReset& reset) {
  if (reset.v[0] > reset.v[1]) {
    report("v", "runs from the higher to the lower; put the lower first");
  }
}

// A YAML file. Throws IoError if it cannot be read, ConfigError with a line for each fault.
EditScript ReadEditScript(const std::filesystem::path& path);

// Throws InputError for a vertex that is not there, that appears twice, or that cannot hold an
// offset; the surface is then as before. Returns the script that takes the edits back: exactly on
// levels above 0, but for rounding on level 0.
EditScript ApplyEdits(const EditScript& script, HSplineSurface& surface);

}  // namespace semblance
