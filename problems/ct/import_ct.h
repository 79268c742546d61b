// SPDX-License-Identifier: GPL-3.0-or-later
// From a CT volume to the meshes of skull and skin.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/volumes/coarser_volume.h"
#include "problems/volumes/ct_volume.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

enum class CtEdges { kThreshold, kHalfMaximum };
constexpr auto EnumNames(CtEdges) {
  return std::to_array<std::string_view>({"threshold", "half_maximum"});
}

struct CtImportOptions {
  double bone_hu = 226;                 // the skull's surface
  double skin_hu = -200;                // the skin's surface; between air and fat
  CtEdges edges = CtEdges::kThreshold;  // half_maximum moves the surfaces between the plateaus
  double thinnest_head_mm = 8;          // thinner things apart from the head are dropped
  double widest_opening_mm = 12;        // air behind narrower openings is inside
  double smallest_bone_cm2 = 3;         // smaller pieces of bone are dropped
  double metal_hu = 3000;               // what has more is metal
  double thinnest_bone_mm = 1.5;        // thinner bone in slices with metal is a streak
  CoarserVoxels coarsen = {};           // the volume is made coarser first
};
template <class Visitor>
void Fields(Visitor& visit, CtImportOptions& o) {
  visit(FieldInfo{.name = "bone_hu",
                  .min = 50,
                  .max = 3000,
                  .doc = "Hounsfield value of the skull's surface; more thins the bone and opens "
                         "thin walls"},
        o.bone_hu);
  visit(FieldInfo{.name = "skin_hu",
                  .min = -900,
                  .max = 0,
                  .doc = "Hounsfield value of the skin's surface, between air (-1000) and fat "
                         "(-100)"},
        o.skin_hu);
  visit(FieldInfo{.name = "edges",
                  .doc = "threshold: where the volume has the value; half_maximum: moved along the "
                         "normal to where it is midway between the two sides, which thins soft "
                         "tissue less (by about 1 mm on the forehead)"},
        o.edges);
  visit(FieldInfo{.name = "thinnest_head_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "what is thinner than this all along, and is not part of the largest "
                         "body, is not head: head holder, tubes, sheets; 0 keeps all that touches"},
        o.thinnest_head_mm);
  visit(FieldInfo{.name = "widest_opening_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "air behind openings narrower than this (nostrils, ears) is inside: its "
                         "walls are not skin; 0 follows them all"},
        o.widest_opening_mm);
  visit(FieldInfo{.name = "smallest_bone_cm2",
                  .unit = "cm^2",
                  .min = 0,
                  .max = 1000,
                  .doc = "pieces of the skull's surface with less area than this are dropped"},
        o.smallest_bone_cm2);
  visit(FieldInfo{.name = "metal_hu",
                  .min = 1500,
                  .max = 32767,
                  .doc = "Hounsfield value above which a voxel is metal (enamel has up to 3000)"},
        o.metal_hu);
  visit(FieldInfo{.name = "thinnest_bone_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "bone thinner than this in slices with metal is taken for a streak; more "
                         "takes thin walls too; 0 keeps all"},
        o.thinnest_bone_mm);
  visit(FieldInfo{.name = "coarsen",
                  .doc = "makes the volume coarser first, each voxel the mean of what it covers: "
                         "what a coarser scan of the same head would have shown"},
        o.coarsen);
}

struct CtImport {
  TriMesh skull, skin;       // mm, LPS, outward; open where the volume cuts them
  int dropped_bone = -1;     // pieces of surface left out, each below the smallest area
  int dropped_skin = -1;     // pieces of skin that are not the largest
  double skull_move_mm = 0;  // by which half maximum moved the surface, mean along the normal
  double skin_move_mm = 0;
  std::vector<std::string> notes;  // what people should know, a line each
};

// Throws InputError if the volume or its bone is smaller than a head, has no tissue, no bone or no
// outside air at these values, or is no volume any more once it is made coarser; Cancelled on
// request.
CtImport ImportCt(const CtVolume& volume, const CtImportOptions& options,
                  const RunContext& context);

}  // namespace semblance
