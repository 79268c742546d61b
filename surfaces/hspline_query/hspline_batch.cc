// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/hspline_query/hspline_batch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/simd.h"

namespace semblance::surfaces {
namespace {

using Polynomial = HSplineBatch::Polynomial;
using Vec4 = double __attribute__((vector_size(32)));  // x, y, z and an unused lane, in one
                                                       // register

constexpr std::size_t kChunk = 16384;  // (u,v) per task of a thread
constexpr std::size_t kBlock = 256;    // (u,v) whose leaves are looked up together

// A block of (u,v), and the destination of its results.
struct Batch {
  const Polynomial* polynomials;  // one per leaf
  const std::int32_t* leaves;     // one per (u,v)
  const Vec2* uv;                 // within the domain
  std::size_t count;
  Vec3* points;
  Vec3* normals;
};

[[gnu::always_inline]] inline Vec4 Load(const Polynomial& p, int k) {
  Vec4 c;
  __builtin_memcpy(&c, p.power[k], sizeof(c));
  return c;
}

[[gnu::always_inline]] inline void Store(const Vec4& v, Vec3& out) {
  out[0] = v[0];
  out[1] = v[1];
  out[2] = v[2];
}

struct Row {  // coefficient of one power of t, and its derivative along s
  Vec4 value, slope;
};

[[gnu::always_inline]] inline Vec4 RowValue(const Polynomial& p, int b, double s) {
  return ((Load(p, 4 * b + 3) * s + Load(p, 4 * b + 2)) * s + Load(p, 4 * b + 1)) * s +
         Load(p, 4 * b);
}

[[gnu::always_inline]] inline Row RowWithSlope(const Polynomial& p, int b, double s) {
  const Vec4 c0 = Load(p, 4 * b), c1 = Load(p, 4 * b + 1), c2 = Load(p, 4 * b + 2),
             c3 = Load(p, 4 * b + 3);
  const Vec4 high = c3 * s + c2, middle = high * s + c1;  // Horner's intermediate sums also give
                                                          // the slope
  return {middle * s + c0, (c3 * s + high) * s + middle};
}

[[gnu::always_inline]] inline Vec4 Next(const Vec4& v) {
  return __builtin_shufflevector(v, v, 1, 2, 0, 3);
}

[[gnu::always_inline]] inline Vec4 Cross(const Vec4& a, const Vec4& b) {
  return Next(a * Next(b) - b * Next(a));
}

[[gnu::always_inline]] inline double SquaredNorm(const Vec4& v) {
  const Vec4 squares = v * v;
  return squares[0] + squares[1] + squares[2];
}

SEMBLANCE_WIDE_256 void EvaluatePoints(const Batch& batch) {
  for (std::size_t k = 0; k < batch.count; ++k) {
    const Polynomial& p = batch.polynomials[batch.leaves[k]];
    const double s = batch.uv[k][0] * p.scale_u - p.first_u,
                 t = batch.uv[k][1] * p.scale_v - p.first_v;
    const Vec4 point = ((RowValue(p, 3, s) * t + RowValue(p, 2, s)) * t + RowValue(p, 1, s)) * t +
                       RowValue(p, 0, s);
    Store(point, batch.points[k]);
  }
}

// Returns the number of points without a normal.
SEMBLANCE_WIDE_256 std::int64_t EvaluateNormals(const Batch& batch) {
  std::int64_t degenerate = 0;
  constexpr double kDegenerate = 1e-12;  // as in HSplineSurface::Frame; round-off
  for (std::size_t k = 0; k < batch.count; ++k) {
    const Polynomial& p = batch.polynomials[batch.leaves[k]];
    const double s = batch.uv[k][0] * p.scale_u - p.first_u,
                 t = batch.uv[k][1] * p.scale_v - p.first_v;
    const Row r0 = RowWithSlope(p, 0, s), r1 = RowWithSlope(p, 1, s), r2 = RowWithSlope(p, 2, s),
              r3 = RowWithSlope(p, 3, s);
    const Vec4 high = r3.value * t + r2.value, middle = high * t + r1.value;
    const Vec4 du = p.scale_u * (((r3.slope * t + r2.slope) * t + r1.slope) * t + r0.slope);
    const Vec4 dv = p.scale_v * ((r3.value * t + high) * t + middle);
    const Vec4 normal = Cross(du, dv);
    const double length = std::sqrt(SquaredNorm(normal));
    const bool regular = length > kDegenerate * (SquaredNorm(du) + SquaredNorm(dv));
    Store(middle * t + r0.value, batch.points[k]);
    Store(normal * (regular ? 1 / length : 0.0), batch.normals[k]);
    degenerate += !regular;
  }
  return degenerate;
}

// The four uniform B-splines of a patch in the power basis: kPower[a][k] is the coefficient of t^a
// in the weight of vertex k.
constexpr double kPower[4][4] = {{1.0 / 6, 4.0 / 6, 1.0 / 6, 0},
                                 {-0.5, 0, 0.5, 0},
                                 {0.5, -1, 0.5, 0},
                                 {-1.0 / 6, 0.5, -0.5, 1.0 / 6}};

Polynomial MakePolynomial(const HSplineSurface& surface, const PatchId& patch) {
  const std::array<Vec3, 16> vertices = surface.PatchVertices(patch);
  Polynomial polynomial{};
  for (int k = 0; k < 256; ++k) {
    const int a = k % 4, b = k / 4 % 4, m = k / 16 % 4, n = k / 64;
    for (int d = 0; d < 3; ++d) {
      polynomial.power[a + 4 * b][d] +=
          kPower[a][m] * kPower[b][n] * (vertices[m + 4 * n][d] - vertices[0][d]);
    }
  }
  for (int d = 0; d < 3; ++d) {  // added last, so that its round-off does not reach the tangents
    polynomial.power[0][d] += vertices[0][d];
  }
  polynomial.scale_u = surface.shape().PatchesU(patch.level);
  polynomial.scale_v = surface.shape().PatchesV(patch.level);
  polynomial.first_u = patch.i;
  polynomial.first_v = patch.j;
  return polynomial;
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
    polynomials_.push_back(MakePolynomial(surface, patch));
  }
}

std::size_t HSplineBatch::Bytes() const {
  return tree_.Bytes() + polynomials_.capacity() * sizeof(Polynomial);
}

void HSplineBatch::Sample(std::span<const Vec2> uv, int threads, Vec3* points, Vec3* normals,
                          std::int64_t* degenerate) const {
  CheckFinite(uv);
  const std::size_t chunks = (uv.size() + kChunk - 1) / kChunk;
  std::vector<std::int64_t> zero(chunks, 0);  // zero normals per chunk
  ParallelFor(chunks, threads, 1, [&](std::size_t c) {
    std::array<std::int32_t, kBlock> leaves;
    std::array<Vec2, kBlock> inside;
    const std::size_t end = std::min((c + 1) * kChunk, uv.size());
    for (std::size_t begin = c * kChunk; begin < end; begin += kBlock) {
      const std::size_t count = std::min(kBlock, end - begin);
      for (std::size_t k = 0; k < count; ++k) {
        inside[k] = tree_.IntoDomain(uv[begin + k]);
        leaves[k] = tree_.LeafAt(inside[k]);
      }
      Batch batch{polynomials_.data(), leaves.data(), inside.data(), count, points + begin, {}};
      if (normals == nullptr) {
        EvaluatePoints(batch);
      } else {
        batch.normals = normals + begin;
        zero[c] += EvaluateNormals(batch);
      }
    }
  });
  *degenerate = std::accumulate(zero.begin(), zero.end(), std::int64_t{0});
}

std::vector<Vec3> HSplineBatch::Points(std::span<const Vec2> uv, int threads) const {
  std::vector<Vec3> points(uv.size());
  std::int64_t none = 0;
  Sample(uv, threads, points.data(), nullptr, &none);
  return points;
}

void HSplineBatch::PointsAndNormals(std::span<const Vec2> uv, int threads,
                                    SurfaceSamples& samples) const {
  samples.points.resize(uv.size());
  samples.normals.resize(uv.size());
  Sample(uv, threads, samples.points.data(), samples.normals.data(), &samples.degenerate);
}

SurfaceSamples HSplineBatch::PointsAndNormals(std::span<const Vec2> uv, int threads) const {
  SurfaceSamples samples;
  PointsAndNormals(uv, threads, samples);
  return samples;
}

}  // namespace semblance::surfaces
