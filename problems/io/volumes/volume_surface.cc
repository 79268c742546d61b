// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/volume_surface.h"

#include <algorithm>
#include <cmath>

#include "surfaces/base/parallel.h"
#include "surfaces/implicit_face.h"
#include "surfaces/marching/polygonize.h"

namespace semblance::problems {
namespace {

// The values along a line through p, from -reach (inside) to +reach.
std::vector<double> Profile(const CtVolume& volume, const HalfMaximumOptions& o, const Vec3& p,
                            const Vec3& outward) {
  const int steps = static_cast<int>(std::lround(o.reach_mm / o.step_mm));
  std::vector<double> profile;
  for (int n = -steps; n <= steps; ++n) {
    profile.push_back(SampleHu(volume, p + n * o.step_mm * outward));
  }
  return profile;
}

// Returns the move from the middle of the profile to the point where the profile falls through the
// value halfway between its plateaus; NaN if that is too far. The plateaus are the ends of the
// slope at the middle.
double HalfMaximum(const std::vector<double>& profile, const HalfMaximumOptions& o) {
  const int middle = static_cast<int>(profile.size() / 2), last = static_cast<int>(profile.size());
  int in = middle, out = middle;
  while (in > 0 && profile[in - 1] >= profile[in]) {
    --in;
  }
  while (out + 1 < last && profile[out + 1] <= profile[out]) {
    ++out;
  }
  const double half = 0.5 * (profile[in] + profile[out]);
  for (int n = in; n < out; ++n) {
    if (profile[n] >= half && profile[n + 1] < half) {
      const double t = (profile[n] - half) / (profile[n] - profile[n + 1]);
      const double move = (n + t - middle) * o.step_mm;
      return std::abs(move) <= o.max_move_mm ? move : kNaN;
    }
  }
  return kNaN;
}

// Replaces each move by the mean of its own and its neighbours' moves. Marching cubes makes sliver
// triangles, whose corners have different normals; smoothing the moves as vectors keeps such
// triangles from flipping.
std::vector<Vec3> SmoothMoves(const TriMesh& mesh, const std::vector<Vec3>& moves) {
  std::vector<Vec3> sum(moves.size(), Vec3::Zero());
  std::vector<double> count(moves.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    const Vec3 all = moves[t[0]] + moves[t[1]] + moves[t[2]];
    for (const std::int32_t corner : t) {
      sum[corner] += all;
      count[corner] += 3;
    }
  }
  for (std::size_t v = 0; v < sum.size(); ++v) {
    sum[v] = count[v] > 0 ? Vec3(sum[v] / count[v]) : moves[v];
  }
  return sum;
}

// Moves a vertex but keeps it within the volume. A vertex on a side of the volume stays on that
// side, because the mesh is cut open there.
Vec3 MoveWithin(const CtVolume& volume, const Vec3& p, const Vec3& move) {
  constexpr double kOnSide = 1e-6;  // voxels
  const Vec3 last(volume.columns - 1, volume.rows - 1, volume.slices - 1);
  const Vec3 from = volume.VoxelAt(p), to = volume.VoxelAt(p + move);
  Vec3 inside = to.cwiseMax(Vec3::Zero()).cwiseMin(last);
  for (int axis = 0; axis < 3; ++axis) {
    if (from[axis] < kOnSide || from[axis] > last[axis] - kOnSide) {
      inside[axis] = from[axis];
    }
  }
  return inside == to ? Vec3(p + move) : volume.World(inside.x(), inside.y(), inside.z());
}

}  // namespace

TriMesh SurfaceAt(const CtVolume& volume, double threshold,
                  const std::function<double(std::size_t)>& value_of, const RunContext& context) {
  std::vector<float> samples(volume.values.size());
  for (std::size_t voxel = 0; voxel < samples.size(); ++voxel) {
    samples[voxel] = static_cast<float>(value_of(voxel) - threshold);
  }
  // The grid is in coordinates along the volume's own axes; its points are converted to LPS below.
  const SampleGrid grid{.origin = volume.axes.inverse() * volume.origin,
                        .cell_mm = volume.spacing_mm,
                        .counts = {volume.columns, volume.rows, volume.slices}};
  TriMesh mesh = PolygonizeSamples(samples, grid, context).mesh;
  for (Vec3& p : mesh.points) {
    p = volume.axes * p;
  }
  return mesh;
}

TriMesh SkinSurface(const CtVolume& volume, const HeadMask& mask, double skin_value, double inside,
                    const RunContext& context, int& dropped) {
  const auto value_of = [&](std::size_t voxel) -> double {
    if (mask.outside[voxel]) {
      return std::min<double>(volume.values[voxel], skin_value - 1);  // removes holder and noise
    }
    return mask.head[voxel] ? volume.values[voxel] : inside;
  };
  return KeepOutermost(SurfaceAt(volume, skin_value, value_of, context), dropped);
}

double MoveToHalfMaximum(const CtVolume& volume, const HalfMaximumOptions& options,
                         const RunContext& context, TriMesh& mesh) {
  const std::vector<Vec3> normals = VertexNormals(mesh);
  std::vector<Vec3> moves(mesh.points.size());
  ParallelFor(moves.size(), context.threads, 1024, [&](std::size_t v) {
    const double move = HalfMaximum(Profile(volume, options, mesh.points[v], normals[v]), options);
    moves[v] = (std::isfinite(move) ? move : 0) * normals[v];
  });
  for (int n = 0; n < options.smoothings; ++n) {
    moves = SmoothMoves(mesh, moves);
  }
  double sum = 0;
  for (std::size_t v = 0; v < moves.size(); ++v) {
    mesh.points[v] = MoveWithin(volume, mesh.points[v], moves[v]);
    sum += moves[v].dot(normals[v]);
  }
  return moves.empty() ? 0 : sum / static_cast<double>(moves.size());
}

}  // namespace semblance::problems
