// SPDX-License-Identifier: GPL-3.0-or-later
// Scattered points, and their reader from CSV text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "surfaces/base/geometry.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::problems {

// A further number of each point, which is fitted over the surface.
struct PointAttribute {
  std::string name;
  std::vector<double> values;  // one per point
};

struct PointTable {
  std::vector<Vec3> positions;             // mm
  std::vector<Vec2> uv;                    // one per point, or none
  std::vector<double> weights;             // > 0; one per point, or none
  bool weights_of_sigma = false;           // the weights are 1 / sigma^2
  bool has_map_columns = false;            // x, y or z has a name of maps, such as lon or depth
  bool has_degrees = false;                // x is named as a longitude, and y as a latitude
  std::vector<PointAttribute> attributes;  // the requested ones, in the requested order
  std::vector<std::uint32_t> exact;        // ascending indices of points to be met exactly
  std::vector<Vec3> exact_normals;         // one per exact point; zero leaves the normal free
  std::vector<Triangle> triangles;         // between the points, if the file has faces
  std::vector<std::string> notes;          // what the reader left out, a sentence each
  std::string file = {};                   // name of the file in messages; empty without a file
  int first_line = 0;                      // line of the first point; 0 if points are not lines
};

// Returns the name of a point in messages, such as "scan.csv:110: point 109".
std::string PointName(const PointTable& table, std::size_t point);

// Makes a point exact. Points must be made exact in ascending order.
void AddExact(PointTable& table, std::size_t point, const Vec3& normal);

// Reads a CSV. The first line names the columns, in any order:
// - x, y and z;
// - u and v, together;
// - weight, or sigma, the standard deviation of a point's coordinates (the weight is 1 / sigma^2);
// - exact: 1 for a point that the surface must meet exactly, else 0; with it nx, ny and nz
// together:
//   the normal of the surface at an exact point, of any length, or 0, 0, 0;
// - the attributes.
// The names may be in capitals. Names of maps also mean x (lon, longitude, long, easting, east), y
// (lat, latitude, northing, north) and z (depth, height, elevation, elev, altitude), unless there
// is a column x, y or z or an attribute of that name. Colours, an intensity and other numbers that
// scanners write (such as r, g, b, intensity) have no effect, which a note states; with
// FurtherColumns::kAny this holds for every further column. Each further line has one decimal
// number per column. Throws IoError
// (`name:line: what`) for any other column, a repeated column, an attribute without a column, a
// line with more or fewer entries, an empty line before the end, an entry that is no finite number,
// a weight or sigma that is not positive, an exact that is neither 0 nor 1, and a table without
// points.
enum class FurtherColumns { kOfScanners, kAny };
PointTable ParsePointTable(std::string_view text, std::string_view name,
                           std::span<const std::string> attributes = {},
                           FurtherColumns further = FurtherColumns::kOfScanners);

// Reads the places x and y of a table whose first line names the columns, also by names of maps.
// Other columns have no effect. Throws IoError as ParsePointTable does.
std::vector<Vec2> ParsePlaces(std::string_view text, std::string_view name);

enum class PointColumn { kX, kY, kZ, kU, kV, kWeight, kSigma, kExact, kNx, kNy, kNz };
constexpr std::size_t kPointColumns = 11;

// The meaning of each column of a table.
struct PointColumns {
  // A PointColumn, kPointColumns + the index of an attribute, or Kinds() for one without effect.
  std::vector<std::size_t> kinds;
  std::vector<std::string> attributes;
  std::string note = {};       // names the columns without effect; empty if there are none
  bool has_map_names = false;  // PointTable::has_map_columns
  bool has_degrees = false;    // PointTable::has_degrees

  std::size_t Kinds() const { return kPointColumns + attributes.size(); }
  bool Has(PointColumn wanted) const;
};
// Reads the first line of a table. Throws as ParsePointTable.
PointColumns ReadPointColumns(std::string_view first_line, std::string_view name,
                              std::span<const std::string> attributes = {},
                              FurtherColumns further = FurtherColumns::kOfScanners);

// The fast reader of tables as programs write them: bare decimal numbers with commas between them.
// It gives up on anything else (blanks, quotes, a plus sign, numbers that are not finite, too many
// or too few entries), and ParsePointTable then reads the text or reports its fault.
class PlainPoints {
 public:
  explicit PlainPoints(PointColumns columns);

  // Adds whole lines; the last one may lack its line end. Returns false if a line is not plain; the
  // points are then unusable.
  bool Add(std::string_view lines);
  void Reserve(std::size_t count);  // points in all
  std::size_t size() const { return table_.positions.size(); }
  PointTable Take() { return std::move(table_); }

 private:
  bool AddLine(const char*& at, const char* end);
  bool AddPoint();
  bool AddExactness();

  PointColumns columns_;
  bool has_uv_ = false, has_weight_ = false, has_sigma_ = false, has_exact_ = false;
  std::vector<double> values_;  // of a line, by kind
  PointTable table_;
};

}  // namespace semblance::problems
