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

namespace semblance::problems {

// One vertex of one level. On level 0 the offset is added to the vertex, in world axes. On finer
// levels it replaces the vertex's offset from the coarser surface (thesis 4.1), and null removes
// that.
struct VertexEdit {
  int level = 0;
  int i = 0;
  int j = 0;
  std::optional<std::array<double, 3>> offset;
};

// Removes all offsets in a part of the domain.
struct RegionReset {
  std::array<double, 2> u = {0, 1};
  std::array<double, 2> v = {0, 1};
  int first_level = 1;
};

struct EditScript {
  std::vector<RegionReset> resets;
  std::vector<VertexEdit> edits;
};

template <class Visitor>
void Fields(Visitor& visit, VertexEdit& o) {
  visit(FieldInfo{.name = "level", .min = 0, .max = 8, .doc = "level of the vertex"}, o.level);
  visit(FieldInfo{.name = "i", .min = 0, .max = 10000, .doc = "index of the vertex along u"}, o.i);
  visit(FieldInfo{.name = "j", .min = 0, .max = 10000, .doc = "index of the vertex along v"}, o.j);
  visit(FieldInfo{.name = "offset",
                  .unit = "mm",
                  .min = -1000,
                  .max = 1000,
                  .doc = "offset from the coarser surface, in the surface's axes of reference "
                         "(level 0: added to the vertex, in world axes); null: follow the coarser "
                         "surface"},
        o.offset);
}

template <class Visitor>
void Fields(Visitor& visit, RegionReset& o) {
  visit(FieldInfo{.name = "u",
                  .min = 0,
                  .max = 1,
                  .doc = "lowest and highest u; a lowest above the "
                         "highest runs across the seam"},
        o.u);
  visit(FieldInfo{.name = "v", .min = 0, .max = 1, .doc = "lowest and highest v"}, o.v);
  visit(FieldInfo{.name = "first_level",
                  .min = 1,
                  .max = 8,
                  .doc = "coarsest level that loses its detail; smaller smooths more"},
        o.first_level);
}

template <class Visitor>
void Fields(Visitor& visit, EditScript& o) {
  visit(FieldInfo{.name = "resets",
                  .doc = "parts of the domain that lose their detail before the edits"},
        o.resets);
  visit(FieldInfo{.name = "edits", .doc = "vertices that get another offset"}, o.edits);
}

template <class Report>
void CheckValue(Report& report, const RegionReset& reset) {
  if (reset.v[0] > reset.v[1]) {
    report("v", "runs from the higher to the lower; put the lower first");
  }
}

// offset: null removes the vertex's own.
VertexEdit MakeEdit(const VertexId& vertex, const std::optional<Vec3>& offset);

// Reads a YAML file. Throws IoError if it cannot be read, and ConfigError with one line per fault.
EditScript ReadEditScript(const std::filesystem::path& path);

// Returns the script that undoes the edits: exactly on levels above 0, up to rounding on level 0.
// Throws InputError, without changing the surface, for a vertex that does not exist, appears twice
// or cannot hold an offset.
EditScript ApplyEdits(const EditScript& script, HSplineSurface& surface);

}  // namespace semblance::problems
