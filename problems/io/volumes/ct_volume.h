// SPDX-License-Identifier: GPL-3.0-or-later
// A volume of CT (in Hounsfield units) or MR with the places of its voxels; its checks, and its
// conversion from the voxel order of a file and to coarser voxels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "surfaces/base/fields.h"
#include "surfaces/base/geometry.h"

namespace semblance::problems {

// The axes are as near to those of LPS as the scan allows: slices run from the feet upwards, rows
// from the front to the back, columns from the subject's right to the left.
struct CtVolume {
  int columns = 0, rows = 0, slices = 0;
  Vec3 spacing_mm = Vec3::Constant(kNaN);  // between columns, rows, slices; > 0
  Vec3 origin = Vec3::Zero();              // centre of the first voxel, LPS, mm
  // Unit steps along columns, rows and slices, in LPS; the determinant is positive. The axes are
  // turned if the head was not straight in the scanner, and skew if its gantry was tilted.
  Mat3 axes = Mat3::Identity();
  std::vector<std::int16_t> values;  // HU, index [slice][row][column]

  std::size_t Index(int column, int row, int slice) const {
    return column + static_cast<std::size_t>(columns) *
                        (row + static_cast<std::size_t>(rows) * static_cast<std::size_t>(slice));
  }
  // The centre of a voxel in LPS, mm; fractions of voxels are allowed.
  Vec3 World(double column, double row, double slice) const {
    return origin + axes * spacing_mm.cwiseProduct(Vec3(column, row, slice));
  }
  // The inverse of World: column, row and slice of a point.
  Vec3 VoxelAt(const Vec3& world) const {
    return (axes.inverse() * (world - origin)).cwiseQuotient(spacing_mm);
  }
};

// The value at a point in LPS by trilinear interpolation. A point outside the volume gets the value
// of the volume's border.
double SampleHu(const CtVolume& volume, const Vec3& world);

// Limits of what is read. The size is that in memory, where a voxel has 2 bytes.
inline constexpr double kMaxVolume_bytes = 8e9;
inline constexpr double kMinSpacing_mm = 0.01, kMaxSpacing_mm = 20;

// The size that a header claims. It is checked before memory is allocated for it.
struct VolumeClaim {
  std::array<double, 3> counts;  // of voxels along each axis
  double bytes_per_voxel = 2;    // in the file, unpacked
  double file_bytes = kNaN;      // size of the file, packed or not; NaN: unknown
};

// Throws InputError, naming `where`, for fewer than one voxel along an axis, and for more than
// kMaxVolume_bytes. Throws IoError if a file of file_bytes cannot hold the voxels, however well it
// is packed.
void CheckVolumeClaim(const VolumeClaim& claim, const std::string& where);

// Throws InputError, naming `where`, unless the volume has at least 2 voxels along each axis, its
// spacing is from kMinSpacing_mm to kMaxSpacing_mm, its axes are right-handed, and there is one
// value per voxel.
void CheckVolume(const CtVolume& volume, const std::string& where);

// Voxels in the order of a file, whose axes may run in any direction.
struct VoxelArray {
  std::array<int, 3> counts = {0, 0, 0};
  Vec3 origin = Vec3::Constant(kNaN);  // centre of the first voxel, LPS, mm
  Mat3 steps = Mat3::Constant(kNaN);   // columns: from a voxel to the next along each axis, mm
  std::vector<std::int16_t> values;    // the first axis runs fastest
  std::int64_t clipped = 0;            // number of values beyond int16, set to its limits
  std::int64_t not_finite = 0;         // number of values that are not finite, set to the lowest
  std::vector<std::string> notes;      // assumptions about what the file leaves open, a line each
};

// Appends a value, rounded. One beyond int16, and one that is not finite, is counted.
inline void AppendRounded(double value, VoxelArray& array) {
  using Limits = std::numeric_limits<std::int16_t>;
  const double rounded = std::isfinite(value) ? std::round(value) : Limits::min();
  const double inside = std::clamp<double>(rounded, Limits::min(), Limits::max());
  array.clipped += inside != rounded ? 1 : 0;
  array.not_finite += std::isfinite(value) ? 0 : 1;
  array.values.push_back(static_cast<std::int16_t>(inside));
}

// Returns the same voxels at the same places with the axes of CtVolume: axes are exchanged and
// reversed as necessary. Throws InputError, naming `where`, like CheckVolume.
CtVolume ToCtVolume(VoxelArray array, const std::string& where);

// The voxels that a coarser scan of the same head would have had.
struct CoarserVoxels {
  double pixel_mm = 0;
  double slice_mm = 0;
};
template <class Visitor>
void Fields(Visitor& visit, CoarserVoxels& o) {
  visit(FieldInfo{.name = "pixel_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "smallest distance between columns and between rows; closer ones are "
                         "merged; 0: as scanned"},
        o.pixel_mm);
  visit(FieldInfo{.name = "slice_mm",
                  .unit = "mm",
                  .min = 0,
                  .max = 10,
                  .doc = "smallest distance between slices; closer ones are merged; 0: as scanned"},
        o.slice_mm);
}

// True if an axis of the volume is finer than `voxels` requests.
bool IsFinerThan(const CtVolume& volume, const CoarserVoxels& voxels);

// Axes that are finer than requested get the requested spacing; the others keep theirs. Each new
// voxel is the mean of the old voxels that it covers, weighted by the covered share. The first new
// voxel lies in the volume's corner; a remainder of less than one new voxel at the far ends is
// dropped. Throws InputError if fewer than 2 new voxels fit along an axis.
CtVolume MakeCoarserVolume(const CtVolume& volume, const CoarserVoxels& voxels, int threads);

}  // namespace semblance::problems
