// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/depth_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "surfaces/base/atomic_file.h"
#include "surfaces/base/csv.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"
#include "surfaces/mesh_files/mesh_io.h"
#include "surfaces/mesh_files/read_ply.h"

namespace semblance::interp {
namespace {

// Reads a column; an empty cell gives NaN.
std::vector<double> CsvColumn(const std::string& text, const std::string& name,
                              const std::string& where) {
  CsvReader csv(text, where);
  const std::size_t column = csv.RequireColumn(name);
  std::vector<double> values;
  while (csv.NextRow()) {
    values.push_back(csv.NumberOrNan(column));
  }
  return values;
}

// A mesh and a depth at each of its vertices.
struct MappedDepth {
  TriMesh mesh;
  std::vector<double> depth_mm;
};

bool IsCsv(const DepthMap& options) { return options.file.extension() == ".csv"; }

MappedDepth ReadMap(const DepthMap& options, const TriMesh& skull) {
  const std::string where = options.file.string();
  if (IsCsv(options)) {
    return {options.mesh.empty() ? skull : ReadMesh(options.mesh),
            CsvColumn(ReadFileBytes(options.file), options.scalar, where)};
  }
  if (options.file.extension() != ".ply") {
    throw InputError(
        fmt::format("depth_map: '{}' is neither .ply nor .csv; give a mesh with a scalar or a "
                    "table",
                    where));
  }
  if (!options.mesh.empty()) {
    throw InputError(
        fmt::format("depth_map: mesh '{}' is given, but the file is a PLY and so a mesh itself; "
                    "leave mesh empty",
                    options.mesh.string()));
  }
  return {ReadMesh(options.file),
          ReadPlyVertexScalar(ReadFileBytes(options.file), options.scalar, where)};
}

void CheckMap(const MappedDepth& map, const DepthMap& options) {
  const std::string where = options.file.string();
  if (map.depth_mm.size() != map.mesh.points.size()) {
    throw InputError(fmt::format(
        "{}: {} depths for {} vertices of {}; there must be one per vertex", where,
        map.depth_mm.size(), map.mesh.points.size(),
        options.mesh.empty() ? std::string("the skull (after fill)") : options.mesh.string()));
  }
  for (std::size_t v = 0; v < map.depth_mm.size(); ++v) {
    if (map.depth_mm[v] <= 0 || std::isinf(map.depth_mm[v])) {
      throw InputError(fmt::format(
          "{}: the depth of vertex {} is {} mm; it must be finite and above 0, or nan for none",
          where, v, map.depth_mm[v]));
    }
  }
}

// The depth at a point; NaN if a corner with a weight has none.
double DepthOn(const MappedDepth& map, const MeshPoint& at) {
  constexpr double kMinWeight = 1e-9;
  const Triangle& t = map.mesh.triangles[at.triangle];
  double depth = 0;
  for (int k = 0; k < 3; ++k) {
    depth += at.weights[k] > kMinWeight ? at.weights[k] * map.depth_mm[t[k]] : 0;
  }
  return depth;
}

}  // namespace

DepthField InterpolateDepth(const DepthMap& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  if (options.file.empty()) {
    throw InputError("depth_map: no file is named; give a PLY or CSV with a depth per vertex");
  }
  const MappedDepth map = ReadMap(options, input.skull);
  CheckMap(map, options);
  DepthField field = EmptyDepthField(input.skull.points.size());
  const MeshQuery query(map.mesh);
  ForEachVertex(input, run, [&](std::size_t i) {
    const MeshPoint nearest = query.Closest(input.skull.points[i]);
    const double depth = nearest.distance_mm <= options.reach_mm ? DepthOn(map, nearest) : kNaN;
    field.depth_mm[i] = depth;
    field.status[i] = std::isnan(depth) ? DepthStatus::kOutside : DepthStatus::kAssigned;
  });
  return field;
}

}  // namespace semblance::interp
