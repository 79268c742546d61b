// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered points, and how they stand in a CSV file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

// A further number of each point, which is fitted too.
struct PointAttribute {
  std::string name;
  std::vector<double> values;  // one per point
};

struct PointTable {
  std::vector<Vec3> positions;             // mm
  std::vector<Vec2> uv;                    // one per point, or none
  std::vector<double> weights;             // > 0; one per point, or none
  bool weights_of_sigma = false;           // they are 1 / sigma^2
  std::vector<PointAttribute> attributes;  // those that were asked for, in that order
  std::vector<std::uint32_t> exact;        // indices of points that are to be met exactly
  std::vector<Vec3> exact_normals;         // one per exact point: zero where it does not matter
  std::vector<Triangle> triangles;         // between the points, where the file has faces
  std::string file = {};                   // that they are of, in messages; empty: of none
  int first_line = 0;                      // of the file, where a point is a line each; else 0
};

// What messages call a point, by its index: "scan.csv:110: point 109".
std::string NameOfPoint(const PointTable& table, std::size_t point);

// Makes a point of a table exact, by its index; they are to be made so in order.
void AddExact(PointTable& table, std::size_t point, const Vec3& normal);

enum class PointColumn { kX, kY, kZ, kU, kV, kWeight, kSigma, kExact, kNx, kNy, kNz };
constexpr std::size_t kPointColumns = 11;

// What the columns of a table are: of each its PointColumn, or kPointColumns + the index of an
// attribute.
struct PointColumns {
  std::vector<std::size_t> kinds;
  std::vector<std::string> attributes;

  std::size_t Kinds() const { return kPointColumns + attributes.size(); }
  bool Has(PointColumn wanted) const;
};
// By the table's first line. Throws as ParsePointTable.
PointColumns PointColumnsOf(std::string_view first_line, std::string_view name,
                            std::span<const std::string> attributes = {});

// The first line names the columns, in any order: x, y and z, and, if wanted, u and v together,
// weight or sigma (the standard deviation of a point's coordinates: the weight is 1 / sigma^2),
// exact (1 for a point that the surface is to meet exactly, else 0) and beside it nx, ny and nz
// together (of an exact point what the surface is to be across, of any length, or 0, 0, 0), and the
// attributes. Each further line has one decimal number per column, separated by commas. Nothing
// else is let pass: `name:line: what` as IoError for another column or one twice, an attribute that
// is no column, a line with more or fewer entries, an empty line before the end, what is not a
// finite number, a weight or sigma that is not positive, an exact that is neither 0 nor 1, or no
// point at all.
PointTable ParsePointTable(std::string_view text, std::string_view name,
                           std::span<const std::string> attributes = {});

}  // namespace semblance
