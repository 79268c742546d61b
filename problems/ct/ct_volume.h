// SPDX-License-Identifier: GPL-3.0-or-later
// A CT volume in Hounsfield units, and its reading from an InVesalius project.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "surfaces/base/geometry.h"

namespace semblance {

// Axial slices from the feet upwards, rows from the back to the front, columns from the subject's
// right to the left.
struct CtVolume {
  int columns = 0, rows = 0, slices = 0;
  Vec3 spacing_mm = Vec3::Constant(kNaN);  // between columns, rows, slices; > 0
  std::vector<std::int16_t> values;        // HU, index [slice][row][column]

  std::size_t Index(int column, int row, int slice) const {
    return column + static_cast<std::size_t>(columns) *
                        (row + static_cast<std::size_t>(rows) * static_cast<std::size_t>(slice));
  }
  // The centre of a voxel in LPS, mm; fractions of voxels are allowed.
  Vec3 World(double column, double row, double slice) const {
    return {spacing_mm.x() * column, -spacing_mm.y() * row, spacing_mm.z() * slice};
  }
};

// HU at a point of the world by trilinear interpolation; outside the volume the value at its
// border.
double SampleHu(const CtVolume& volume, const Vec3& world);

// Throws InputError, naming `where`, unless the volume is at least 2 voxels each way, its spacing
// is positive and finite, and there is one value per voxel.
void CheckVolume(const CtVolume& volume, const std::string& where);

// Reads an InVesalius project (.inv3: a tar, gzipped or not, of `main.plist` and the matrix it
// names). Throws IoError if there is no such file, it is no such archive, or an entry is missing or
// of the wrong size; InputError for a type other than int16 or a shape or spacing that cannot be.
CtVolume ReadInvesalius(const std::filesystem::path& path);

}  // namespace semblance
