// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered points in files of several kinds.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "problems/points/point_table.h"

namespace semblance {

struct PointFile {
  PointTable points;
  std::string sha256;  // of the bytes as they were read, lower-case hexadecimal
};

// By the ending, in any case: .csv and .txt (ParsePointTable); .xyz (x, y, z on each line; #
// begins a comment); .npy (n x 3: x, y, z; n x 5: u and v
// too); .ply (the vertices' x, y, z, u, v or s, t if they have them, weight or sigma, exact and
// with it nx, ny, nz, the attributes, and the faces); .obj (the lines `v` and `f`); .stl and .off
// (points in single precision and triangles; equal corners of an STL are one point). Each may be
// compressed: .csv.gz.
// "-" stands for a CSV on standard input.
//   attributes: further numbers to read, of a table or a PLY; other kinds have none.
// Throws IoError for a file that cannot be read, another ending, or what ParsePointTable refuses;
// InputError for anything in the file that is not of its kind.
PointFile ReadPointFile(const std::filesystem::path& path,
                        std::span<const std::string> attributes = {});

}  // namespace semblance
