// SPDX-License-Identifier: GPL-3.0-or-later
// Readers of scattered points from files.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "problems/points/point_table.h"

namespace semblance::problems {

struct PointFile {
  PointTable points;
  std::string sha256;  // of the bytes as they were read, lower-case hexadecimal
};

// Reads the points in the format of the file's ending (in any case), possibly compressed (.csv.gz):
// - .csv and .txt: ParsePointTable; also with semicolons (and decimal commas), or with blanks or
// tabs
//   between the entries, as in `//X Y Z R G B` of CloudCompare; without names of columns the first
//   three are x, y and z;
// - .xyz: x, y and z on each line, and further numbers without effect; # begins a comment; a first
//   line may name the columns; .pts the same, after a line with the number of points; .asc the
//   same, or an ASCII grid of ESRI;
// - .npy: n x 3 (x, y, z) or n x 5 (x, y, z, u, v);
// - .ply: properties of the vertices: x, y, z; u, v or s, t; weight or sigma; exact, with nx, ny,
//   nz; the attributes; and the faces;
// - .obj: the lines `v` and `f`;
// - .stl and .off: points in single precision, and triangles; equal corners of an STL are one
// point.
// Points without finite coordinates, as of organised clouds, stay in the table as nan; FitPoints
// leaves them out.
// "-" stands for a CSV on standard input.
//   attributes: further numbers to read from a table or a PLY; other formats have none.
// Throws IoError for a file that cannot be read, another ending, and as ParsePointTable; InputError
// for contents that do not fit the format.
PointFile ReadPointFile(const std::filesystem::path& path,
                        std::span<const std::string> attributes = {});

// Reads places: a table with columns x and y (or lon, lat and so on, as of points), with commas,
// semicolons or blanks between the entries, or the first two columns of a .npy; each may end in
// .gz; "-" is a table on standard input. Other columns have no effect. Throws as ReadPointFile.
std::vector<Vec2> ReadPlaces(const std::filesystem::path& path);

}  // namespace semblance::problems
