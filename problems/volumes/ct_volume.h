// SPDX-License-Identifier: GPL-3.0-or-later
// A volume of CT (in Hounsfield units) or MR, and where its voxels are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// As near as the scan's axes are to those of LPS: slices from the feet upwards, rows from the front
// to the back, columns from the subject's right to the left.
struct CtVolume {
  int columns = 0, rows = 0, slices = 0;
  Vec3 spacing_mm = Vec3::Constant(kNaN);  // between columns, rows, slices; > 0
  Vec3 origin = Vec3::Zero();              // centre of the first voxel, LPS, mm
  // Unit steps along columns, rows and slices, in LPS; positive determinant. Turned where the head
  // was not straight in the scanner, skew where its gantry was tilted.
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

// HU at a point of the world by trilinear interpolation; outside the volume the value at its
// border.
double SampleHu(const CtVolume& volume, const Vec3& world);

// What is read at most, as it lies in memory, and between which voxels.
inline constexpr double kLargestVolume_bytes = 8e9;
inline constexpr double kLeastSpacing_mm = 0.01, kMostSpacing_mm = 20;

// What a header claims, before memory is taken for it.
struct VolumeClaim {
  std::array<double, 3> counts;  // of voxels along each axis
  double bytes_per_voxel = 2;    // in the file, unpacked
  double file_bytes = kNaN;      // that have to hold them, packed or not; NaN: not known
};

// Throws InputError, naming `where`, for fewer than one voxel along an axis, more than
// kLargestVolume_bytes (with 2 bytes per voxel, as we keep them), or more than a file of that size
// can hold however it is packed.
void CheckVolumeClaim(const VolumeClaim& claim, const std::string& where);

// Throws InputError, naming `where`, unless the volume is at least 2 voxels each way, its spacing
// is from kLeastSpacing_mm to kMostSpacing_mm, its axes are right-handed, and there is one value
// per voxel.
void CheckVolume(const CtVolume& volume, const std::string& where);

}  // namespace semblance
