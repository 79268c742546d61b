// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "surfaces/error.h"
#include "surfaces/parallel.h"

// The kernels also as code for newer processors, chosen when the program starts. Products and sums
// are never fused (-ffp-contract=off), so all give the same bytes. Not under sanitizers, which do
// not run so early.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__clang__)
#define SEMBLANCE_KERNEL __attribute__((target_clones("avx2", "default"), noinline))
#else
#define SEMBLANCE_KERNEL
#endif

namespace semblance {
namespace {

using Polynomial = HSplineBatch::Polynomial;

constexpr std::size_t kChunk = 65536;  // (u,v) grouped by patch together; their results fit a cache
constexpr std::size_t kPack = 64;      // (u,v) of one patch in one call of a kernel

// Parameters in, results out, of some (u,v) of one patch.
struct Pack {
  double s[kPack], t[kPack];
  double point[3][kPack];
  double normal[3][kPack];
};

// The cubic, or its derivative, with the coefficients at c[0], c[step], ...
[[gnu::always_inline]] inline double Cubic(double c0, double c1, double c2, double c3, double x) {
  return ((c3 * x + c2) * x + c1) * x + c0;
}
[[gnu::always_inline]] inline double CubicSlope(double c1, double c2, double c3, double x) {
  return (3 * c3 * x + 2 * c2) * x + c1;
}

struct Jet {
  double value, along_s, along_t;
};

[[gnu::always_inline]] inline double ValueOf(const double* c, double s, double t) {
  return Cubic(Cubic(c[0], c[1], c[2], c[3], s), Cubic(c[4], c[5], c[6], c[7], s),
               Cubic(c[8], c[9], c[10], c[11], s), Cubic(c[12], c[13], c[14], c[15], s), t);
}

[[gnu::always_inline]] inline Jet JetOf(const double* c, double s, double t) {
  const double r0 = Cubic(c[0], c[1], c[2], c[3], s), r1 = Cubic(c[4], c[5], c[6], c[7], s),
               r2 = Cubic(c[8], c[9], c[10], c[11], s), r3 = Cubic(c[12], c[13], c[14], c[15], s);
  const double d0 = CubicSlope(c[1], c[2], c[3], s), d1 = CubicSlope(c[5], c[6], c[7], s),
               d2 = CubicSlope(c[9], c[10], c[11], s), d3 = CubicSlope(c[13], c[14], c[15], s);
  return {Cubic(r0, r1, r2, r3, t), Cubic(d0, d1, d2, d3, t), CubicSlope(r1, r2, r3, t)};
}

SEMBLANCE_KERNEL void EvaluatePoints(const Polynomial& __restrict p, std::size_t count,
                                     Pack& __restrict pack) {
  for (std::size_t k = 0; k < count; ++k) {
    pack.point[0][k] = ValueOf(p.power[0], pack.s[k], pack.t[k]);
    pack.point[1][k] = ValueOf(p.power[1], pack.s[k], pack.t[k]);
    pack.point[2][k] = ValueOf(p.power[2], pack.s[k], pack.t[k]);
  }
}

SEMBLANCE_KERNEL void EvaluateNormals(const Polynomial& __restrict p, std::size_t count,
                                      Pack& __restrict pack) {
  constexpr double kDegenerate = 1e-12;  // as HSplineSurface::Frame judges
  const double su = p.scale_u, sv = p.scale_v;
  for (std::size_t k = 0; k < count; ++k) {
    const Jet x = JetOf(p.power[0], pack.s[k], pack.t[k]);
    const Jet y = JetOf(p.power[1], pack.s[k], pack.t[k]);
    const Jet z = JetOf(p.power[2], pack.s[k], pack.t[k]);
    const double ux = su * x.along_s, uy = su * y.along_s, uz = su * z.along_s;
    const double vx = sv * x.along_t, vy = sv * y.along_t, vz = sv * z.along_t;
    const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const double length = std::sqrt(nx * nx + ny * ny + nz * nz);
    const double tangents = ux * ux + uy * uy + uz * uz + (vx * vx + vy * vy + vz * vz);
    const double regular = length > kDegenerate * tangents ? 1.0 : 0.0;
    const double inverse = regular / (length + (1 - regular));  // no branch: vectorised
    pack.point[0][k] = x.value;
    pack.point[1][k] = y.value;
    pack.point[2][k] = z.value;
    pack.normal[0][k] = nx * inverse;
    pack.normal[1][k] = ny * inverse;
    pack.normal[2][k] = nz * inverse;
  }
}

// Coefficients of the four uniform B-splines on a patch: kPower[a][k] of t^a in that of vertex k.
constexpr double kPower[4][4] = {{1.0 / 6, 4.0 / 6, 1.0 / 6, 0},
                                 {-0.5, 0, 0.5, 0},
                                 {0.5, -1, 0.5, 0},
                                 {-1.0 / 6, 0.5, -0.5, 1.0 / 6}};

Polynomial PolynomialOf(const HSplineSurface& surface, const PatchId& patch) {
  const std::array<Vec3, 16> vertices = PatchVertices(surface, patch);
  Polynomial polynomial{};
  for (int k = 0; k < 256; ++k) {
    const int a = k % 4, b = k / 4 % 4, m = k / 16 % 4, n = k / 64;
    for (int d = 0; d < 3; ++d) {
      polynomial.power[d][a + 4 * b] +=
          kPower[a][m] * kPower[b][n] * (vertices[m + 4 * n][d] - vertices[0][d]);
    }
  }
  for (int d = 0; d < 3; ++d) {  // apart, so that tangents are not rounded to the place's size
    polynomial.power[d][0] += vertices[0][d];
  }
  polynomial.scale_u = surface.shape().PatchesU(patch.level);
  polynomial.scale_v = surface.shape().PatchesV(patch.level);
  return polynomial;
}

// A stretch of the questions, with the order in which to take them: by leaf.
struct Chunk {
  std::vector<LeafPlace> places;
  std::vector<std::uint32_t> order;
};

Chunk GroupByLeaf(const PatchTree& tree, std::span<const Vec2> uv) {
  Chunk chunk;
  chunk.places.resize(uv.size());
  std::vector<std::uint32_t> first(tree.leaves().size() + 1, 0);
  for (std::size_t k = 0; k < uv.size(); ++k) {
    chunk.places[k] = tree.Find(uv[k]);
    ++first[chunk.places[k].leaf + 1];
  }
  for (std::size_t leaf = 1; leaf < first.size(); ++leaf) {
    first[leaf] += first[leaf - 1];
  }
  chunk.order.resize(uv.size());
  for (std::size_t k = 0; k < uv.size(); ++k) {
    chunk.order[first[chunk.places[k].leaf]++] = static_cast<std::uint32_t>(k);
  }
  return chunk;
}

// How many of the chunk's questions, from `begin` on, lie in one leaf and fit one pack.
std::size_t RunLength(const Chunk& chunk, std::size_t begin) {
  const std::size_t most = std::min(kPack, chunk.order.size() - begin);
  const std::int32_t leaf = chunk.places[chunk.order[begin]].leaf;
  std::size_t count = 1;
  while (count < most && chunk.places[chunk.order[begin + count]].leaf == leaf) {
    ++count;
  }
  return count;
}

void Answer(const Polynomial& polynomial, const Chunk& chunk, std::span<const std::uint32_t> run,
            Vec3* points, Vec3* normals) {
  Pack pack;
  for (std::size_t k = 0; k < run.size(); ++k) {
    pack.s[k] = chunk.places[run[k]].s;
    pack.t[k] = chunk.places[run[k]].t;
  }
  normals != nullptr ? EvaluateNormals(polynomial, run.size(), pack)
                     : EvaluatePoints(polynomial, run.size(), pack);
  for (std::size_t k = 0; k < run.size(); ++k) {
    points[run[k]] = Vec3(pack.point[0][k], pack.point[1][k], pack.point[2][k]);
    if (normals != nullptr) {
      normals[run[k]] = Vec3(pack.normal[0][k], pack.normal[1][k], pack.normal[2][k]);
    }
  }
}

void CheckFinite(std::span<const Vec2> uv) {
  for (std::size_t k = 0; k < uv.size(); ++k) {
    if (!uv[k].allFinite()) {
      throw InputError(
          fmt::format("H-spline: (u,v) number {} = ({}, {}) is not finite; the domain is [0,1] x "
                      "[0,1]",
                      k, uv[k].x(), uv[k].y()));
    }
  }
}

}  // namespace

HSplineBatch::HSplineBatch(const HSplineSurface& surface) : tree_(surface) {
  polynomials_.reserve(tree_.leaves().size());
  for (const PatchId& patch : tree_.leaves()) {
    polynomials_.push_back(PolynomialOf(surface, patch));
  }
}

std::size_t HSplineBatch::Bytes() const {
  return tree_.Bytes() + polynomials_.capacity() * sizeof(Polynomial);
}

std::int64_t HSplineBatch::Sample(std::span<const Vec2> uv, int threads, Vec3* points,
                                  Vec3* normals) const {
  CheckFinite(uv);
  const std::size_t chunks = (uv.size() + kChunk - 1) / kChunk;
  ParallelFor(chunks, threads, 1, [&](std::size_t c) {
    const std::size_t begin = c * kChunk, size = std::min(kChunk, uv.size() - begin);
    const Chunk chunk = GroupByLeaf(tree_, uv.subspan(begin, size));
    for (std::size_t k = 0, count = 0; k < size; k += count) {
      count = RunLength(chunk, k);
      Answer(polynomials_[chunk.places[chunk.order[k]].leaf], chunk, {&chunk.order[k], count},
             points + begin, normals == nullptr ? nullptr : normals + begin);
    }
  });
  return normals == nullptr ? 0 : std::count_if(normals, normals + uv.size(), [](const Vec3& n) {
    return n.isZero(0);
  });
}

std::vector<Vec3> HSplineBatch::Points(std::span<const Vec2> uv, int threads) const {
  std::vector<Vec3> points(uv.size());
  Sample(uv, threads, points.data(), nullptr);
  return points;
}

SurfaceSamples HSplineBatch::PointsAndNormals(std::span<const Vec2> uv, int threads) const {
  SurfaceSamples samples;
  samples.points.resize(uv.size());
  samples.normals.resize(uv.size());
  samples.degenerate = Sample(uv, threads, samples.points.data(), samples.normals.data());
  return samples;
}

}  // namespace semblance
