// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/edge_shift.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surfaces/parallel.h"

namespace semblance {
namespace {

// Values along a line through p, from -reach (inside) to +reach.
std::vector<double> Profile(const CtVolume& volume, const HalfMaximumOptions& o, const Vec3& p,
                            const Vec3& outward) {
  const int steps = static_cast<int>(std::lround(o.reach_mm / o.step_mm));
  std::vector<double> profile;
  for (int n = -steps; n <= steps; ++n) {
    profile.push_back(SampleHu(volume, p + n * o.step_mm * outward));
  }
  return profile;
}

// Where, nearest to the middle of the profile, it falls through half way between its plateaus;
// NaN if that is too far. The plateaus are the tops that the slope at the middle leads to.
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
      return std::abs(move) <= o.most_move_mm ? move : kNaN;
    }
  }
  return kNaN;
}

// Each move becomes the mean of its own and those of its neighbours that have one.
std::vector<double> Smoothed(const TriMesh& mesh, const std::vector<double>& moves) {
  std::vector<double> sum(moves.size(), 0), count(moves.size(), 0);
  const auto add = [&](std::int32_t to, std::int32_t from) {
    if (std::isfinite(moves[from])) {
      sum[to] += moves[from];
      count[to] += 1;
    }
  };
  for (const Triangle& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      add(t[c], t[c]);
      add(t[c], t[(c + 1) % 3]);
      add(t[(c + 1) % 3], t[c]);
    }
  }
  for (std::size_t v = 0; v < sum.size(); ++v) {
    sum[v] = count[v] > 0 ? sum[v] / count[v] : kNaN;
  }
  return sum;
}

}  // namespace

double MoveToHalfMaximum(const CtVolume& volume, const HalfMaximumOptions& options,
                         const RunContext& context, TriMesh& mesh) {
  const std::vector<Vec3> normals = VertexNormals(mesh);
  std::vector<double> moves(mesh.points.size(), kNaN);
  ParallelFor(moves.size(), context.threads, 1024, [&](std::size_t v) {
    moves[v] = HalfMaximum(Profile(volume, options, mesh.points[v], normals[v]), options);
  });
  for (int n = 0; n < options.smoothings; ++n) {
    moves = Smoothed(mesh, moves);
  }
  double sum = 0;
  for (std::size_t v = 0; v < moves.size(); ++v) {
    const double move = std::isfinite(moves[v]) ? moves[v] : 0;
    mesh.points[v] += move * normals[v];
    sum += move;
  }
  return moves.empty() ? 0 : sum / static_cast<double>(moves.size());
}

}  // namespace semblance
