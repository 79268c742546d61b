// SPDX-License-Identifier: GPL-3.0-or-later
// A volume as a coarser scan of the same head would have shown it.
#pragma once

#include "problems/volumes/ct_volume.h"
#include "surfaces/base/fields.h"

namespace semblance {

struct CoarserVoxels {
  double pixel_mm = 0;  // between columns and rows, at least; 0: as they are
  double slice_mm = 0;  // between slices, at least; 0: as they are
};
template <class Visitor>
void Fields(Visitor& visit, CoarserVoxels& o) {
  visit(FieldInfo{.name = "pixel_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "columns and rows that are closer than this get this distance; 0: as "
                         "scanned"},
        o.pixel_mm);
  visit(FieldInfo{.name = "slice_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "likewise slices; 0: as scanned"},
        o.slice_mm);
}

// Whether any axis of the volume is finer than what is asked.
bool IsFinerThan(const CtVolume& volume, const CoarserVoxels& voxels);

// Axes that are finer get the spacing that is asked, the others stay. Each new voxel is the mean of
// what it covers, a voxel that it cuts counting by its part. The first lies in the volume's corner;
// what is left at the far ends, less than a new voxel, is left out. Throws InputError where fewer
// than 2 new voxels fit along an axis.
CtVolume CoarserVolume(const CtVolume& volume, const CoarserVoxels& voxels, int threads);

}  // namespace semblance
