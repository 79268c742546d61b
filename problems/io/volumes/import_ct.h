// SPDX-License-Identifier: GPL-3.0-or-later
// Extracts the meshes of skull and skin from a CT volume, and that of the skin alone from an MR
// volume: in MR bone is as dark as air.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "problems/io/volumes/ct_volume.h"
#include "surfaces/base/fields.h"
#include "surfaces/base/run_context.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

enum class CtEdges { kThreshold, kHalfMaximum };
constexpr auto EnumNames(CtEdges) {
  return std::to_array<std::string_view>({"threshold", "half_maximum"});
}

struct CtImportOptions {
  double bone_hu = 226;
  double skin_hu = -200;
  CtEdges edges = CtEdges::kThreshold;
  double thinnest_head_mm = 8;
  double widest_opening_mm = 12;
  double smallest_bone_cm2 = 3;
  double metal_hu = 3000;
  double thinnest_bone_mm = 1.5;
  CoarserVoxels coarsen = {};
};
template <class Visitor>
void Fields(Visitor& visit, CtImportOptions& o) {
  visit(FieldInfo{.name = "bone_hu",
                  .min = 50,
                  .max = 3000,
                  .doc = "Hounsfield value of the skull's surface; a higher value thins the "
                         "bone and opens thin walls"},
        o.bone_hu);
  visit(FieldInfo{.name = "skin_hu",
                  .min = -900,
                  .max = 0,
                  .doc = "Hounsfield value of the skin's surface, between air (-1000) and fat "
                         "(-100)"},
        o.skin_hu);
  visit(FieldInfo{.name = "edges",
                  .doc = "threshold: the surface has the given value; half_maximum: its vertices "
                         "then move along the normal to the value midway between the two sides, "
                         "which thins soft tissue less (by about 1 mm on the forehead)"},
        o.edges);
  visit(FieldInfo{.name = "thinnest_head_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "objects that are thinner than this everywhere and apart from the largest "
                         "body are dropped: head holder, tubes, sheets; 0 keeps all that touch "
                         "the head"},
        o.thinnest_head_mm);
  visit(FieldInfo{.name = "widest_opening_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 50,
                  .doc = "air behind openings narrower than this (nostrils, ears) is inside: its "
                         "walls are not skin; 0 follows all openings"},
        o.widest_opening_mm);
  visit(FieldInfo{.name = "smallest_bone_cm2",
                  .unit = "cm^2",
                  .min = 0,
                  .max = 1000,
                  .doc = "pieces of the skull's surface with a smaller area are dropped"},
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
                  .doc = "bone thinner than this in slices with metal is removed as a streak; a "
                         "larger value removes thin walls too; 0 keeps all"},
        o.thinnest_bone_mm);
  visit(FieldInfo{.name = "coarsen",
                  .doc = "first makes the volume coarser, as a coarser scan of the same head would "
                         "be: each voxel is the mean of the voxels that it covers"},
        o.coarsen);
}

struct CtImport {
  TriMesh skull, skin;             // mm, LPS, outward; open where the volume cuts them
  int dropped_bone = -1;           // pieces of bone surface below smallest_bone_cm2
  int dropped_skin = -1;           // pieces of skin other than the largest
  double skull_move_mm = 0;        // mean move of half_maximum along the normal
  double skin_move_mm = 0;         // mean move of half_maximum along the normal
  std::vector<std::string> notes;  // for people, a line each
};

// Throws InputError if the volume or its bone is smaller than a head, if it has no tissue, no bone
// or no outside air at these values, and if too few voxels remain once it is made coarser. Throws
// Cancelled on request.
CtImport ImportCt(const CtVolume& volume, const CtImportOptions& options,
                  const RunContext& context);

struct MrSkinOptions {
  double skin_value = 0;          // grey value of the skin's surface; 0: OtsuThreshold
  double thinnest_head_mm = 8;    // as in CtImportOptions
  double widest_opening_mm = 12;  // as in CtImportOptions
};

struct MrSkin {
  TriMesh skin;  // mm, LPS, outward; open where the volume cuts it
  double skin_value = kNaN;
  int dropped = -1;  // pieces other than the largest
  std::vector<std::string> notes;
};

// The threshold between the volume's dark and bright voxels that minimises the variance within both
// groups (Otsu 1979). The histogram has 256 classes and ends at the value that one voxel in a
// thousand exceeds.
double OtsuThreshold(const CtVolume& volume);

// Throws InputError if the volume or the skin is smaller than a head, if nothing is as thick as a
// head, or if no dark voxels reach the sides.
MrSkin ImportMrSkin(const CtVolume& volume, const MrSkinOptions& options,
                    const RunContext& context);

}  // namespace semblance::problems
