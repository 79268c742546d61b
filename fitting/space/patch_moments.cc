// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/space/patch_moments.h"

#include <algorithm>
#include <array>

#include "surfaces/base/simd.h"
#include "surfaces/hspline/bspline.h"

namespace semblance::fitting {
namespace {

using Vec4 = double __attribute__((vector_size(32)));

// 48 times the coefficients of 1, z, z^2, z^3 of the four B-spline segments on s in [0,1], with z =
// 2 s - 1.
constexpr double kSegment[4][4] = {
    {1, -3, 3, -1}, {23, -15, -3, 3}, {23, 15, -3, -3}, {1, 3, 3, 1}};

// Row k holds the coefficients of z_u^a z_v^b, at a + 4 b, of the B-spline of vertex k.
Matrix16 MakePowers() {
  Matrix16 powers;
  for (int k = 0; k < 16; ++k) {
    for (int m = 0; m < 16; ++m) {
      powers(k, m) = kSegment[k % 4][m % 4] / 48 * (kSegment[k / 4][m / 4] / 48);
    }
  }
  return powers;
}

const Matrix16& VertexPowers() {
  static const Matrix16 powers = MakePowers();
  return powers;
}

struct Polynomial {
  Vec4 power[16];  // coefficients of z_u^a z_v^b at a + 4 b
  double scale;    // z_u = x * scale - shift_u
  double shift_u, shift_v;
};

Polynomial MakePolynomial(const PatchId& patch, const PatchMatrix& vertices) {
  const PatchMatrix powers = VertexPowers().transpose() * vertices;
  Polynomial p{};
  for (int m = 0; m < 16; ++m) {
    p.power[m] = Vec4{powers(m, 0), powers(m, 1), powers(m, 2), 0};
  }
  p.scale = 2.0 * (1 << patch.level);
  p.shift_u = 2.0 * patch.i + 1;
  p.shift_v = 2.0 * patch.j + 1;
  return p;
}

// A point whose loss halves its weight, or more, is an outlier and must not cause refinement.
constexpr double kOutlierFactor = 0.5;

inline double FactorMoments(const double* factors, std::size_t k) {
  return factors == nullptr ? 1 : factors[k];
}

struct Batch {
  const CloudPoint* points;
  std::size_t count;
  const double* factors;
  double* squares;
  bool moments;
};

[[gnu::always_inline]] inline Vec4 RowAt(const Polynomial& p, int b, double z) {
  return ((p.power[4 * b + 3] * z + p.power[4 * b + 2]) * z + p.power[4 * b + 1]) * z +
         p.power[4 * b];
}

[[gnu::always_inline]] inline void AddPowers(Vec4 low, Vec4 high, double y, Vec4 (&moments)[7][2]) {
  for (int q = 0; q < 7; ++q) {
    moments[q][0] += low;
    moments[q][1] += high;
    low = low * y;
    high = high * y;
  }
}

SEMBLANCE_WIDE_256 void Accumulate(const Batch& batch, const Polynomial& p, PatchMoments& sums) {
  Vec4 moments[7][2], residual[16];
  __builtin_memcpy(moments, sums.moments, sizeof moments);
  __builtin_memcpy(residual, sums.residual, sizeof residual);
  for (std::size_t k = 0; k < batch.count; ++k) {
    const CloudPoint& point = batch.points[k];
    const double z = point.x * p.scale - p.shift_u, y = point.y * p.scale - p.shift_v;
    const double w = batch.factors == nullptr ? point.weight() : point.weight() * batch.factors[k];
    Vec4 values;
    __builtin_memcpy(&values, point.values.data(), sizeof values);
    const Vec4 e = values - (((RowAt(p, 3, z) * y + RowAt(p, 2, z)) * y + RowAt(p, 1, z)) * y +
                             RowAt(p, 0, z));
    const Vec4 ee = e * e;
    const double square = ee[0] + ee[1] + ee[2];
    sums.squares += w * square;
    const bool outlier = batch.factors != nullptr && batch.factors[k] < kOutlierFactor;
    sums.largest = !outlier && square > sums.largest ? square : sums.largest;
    if (batch.squares != nullptr) {
      batch.squares[k] = square;
    }
    const double z2 = z * z, z3 = z2 * z;
    Vec4 along = e * w;
    for (int b = 0; b < 4; ++b) {
      residual[4 * b] += along;
      residual[4 * b + 1] += along * z;
      residual[4 * b + 2] += along * z2;
      residual[4 * b + 3] += along * z3;
      along = along * y;
    }
    if (batch.moments) {
      const Vec4 low = Vec4{1, z, z2, z3} * w;
      AddPowers(low, low * (z2 * z2), y, moments);
    }
  }
  __builtin_memcpy(sums.moments, moments, sizeof moments);
  __builtin_memcpy(sums.residual, residual, sizeof residual);
}

[[gnu::always_inline]] inline Vec4 Along(const std::array<double, 4>& w, const Vec4* vertices) {
  return w[0] * vertices[0] + w[1] * vertices[1] + w[2] * vertices[2] + w[3] * vertices[3];
}

SEMBLANCE_WIDE_256 void AccumulateByVertex(const Batch& batch, const PatchId& patch,
                                           const PatchMatrix& vertices, PatchMoments& sums) {
  Vec4 vertex[16], residual[16];
  for (int k = 0; k < 16; ++k) {
    vertex[k] = Vec4{vertices(k, 0), vertices(k, 1), vertices(k, 2), 0};
  }
  __builtin_memcpy(residual, sums.residual, sizeof residual);
  const double scale = 1 << patch.level;
  for (std::size_t k = 0; k < batch.count; ++k) {
    const CloudPoint& p = batch.points[k];
    const auto u = CubicWeights(p.x * scale - patch.i, 0),
               v = CubicWeights(p.y * scale - patch.j, 0);
    Vec4 values;
    __builtin_memcpy(&values, p.values.data(), sizeof values);
    const Vec4 e = values - (v[0] * Along(u, vertex) + v[1] * Along(u, vertex + 4) +
                             v[2] * Along(u, vertex + 8) + v[3] * Along(u, vertex + 12));
    const Vec4 ee = e * e;
    const double square = ee[0] + ee[1] + ee[2], factor = FactorMoments(batch.factors, k);
    sums.squares += p.weight() * factor * square;
    sums.largest = factor >= kOutlierFactor && square > sums.largest ? square : sums.largest;
    if (batch.squares != nullptr) {
      batch.squares[k] = square;
    }
    const Vec4 pull = e * (p.weight() * factor);
    for (int m = 0; m < 16; ++m) {
      residual[m] += pull * (u[m % 4] * v[m / 4]);
    }
  }
  __builtin_memcpy(sums.residual, residual, sizeof residual);
}

Matrix16 MakeRefinement(int right, int upper) {
  Matrix16 refinement = Matrix16::Zero();
  for (int k = 0; k < 16; ++k) {
    const RefinementRow u = RefineRow(right + k % 4), v = RefineRow(upper + k / 4);
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        refinement(k, u.index[a] + 4 * v.index[b]) += u.weight[a] * v.weight[b];
      }
    }
  }
  return refinement;
}

using VertexWeights = Eigen::Matrix<double, 16, 1>;

VertexWeights WeightsAt(const CloudPoint& p, const PatchId& patch) {
  const double scale = 1 << patch.level;
  const auto along_u = CubicWeights(p.x * scale - patch.i, 0),
             along_v = CubicWeights(p.y * scale - patch.j, 0);
  VertexWeights weights;
  for (int k = 0; k < 16; ++k) {
    weights[k] = along_u[k % 4] * along_v[k / 4];
  }
  return weights;
}

}  // namespace

void AddMoments(std::span<const CloudPoint> points, const PatchId& patch,
                const PatchMatrix& vertices, bool moments, const PointFactors& each,
                PatchMoments& sums) {
  Accumulate({points.data(), points.size(), each.factors, each.squares, moments},
             MakePolynomial(patch, vertices), sums);
}

Matrix16 GramOfMoments(const PatchMoments& sums) {
  Matrix16 of_powers;
  for (int k = 0; k < 16; ++k) {
    for (int l = 0; l < 16; ++l) {
      of_powers(k, l) = sums.moments[k / 4 + l / 4][k % 4 + l % 4];
    }
  }
  return VertexPowers() * of_powers * VertexPowers().transpose();
}

PatchMatrix ResidualOfMoments(const PatchMoments& sums) {
  return VertexPowers() * ResidualOfPoints(sums);
}

void AddPoints(std::span<const CloudPoint> points, const PatchId& patch,
               const PatchMatrix& vertices, const PointFactors& each, PatchMoments& sums) {
  AccumulateByVertex({points.data(), points.size(), each.factors, each.squares, /*moments=*/false},
                     patch, vertices, sums);
}

Matrix16 GramOfPoints(std::span<const CloudPoint> points, const PatchId& patch,
                      const double* factors) {
  Matrix16 gram = Matrix16::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    const VertexWeights weights = WeightsAt(points[k], patch);
    gram.noalias() +=
        points[k].weight() * FactorMoments(factors, k) * weights * weights.transpose();
  }
  return gram;
}

PatchMatrix ResidualOfPoints(const PatchMoments& sums) {
  PatchMatrix residual;
  for (int k = 0; k < 16; ++k) {
    residual.row(k) << sums.residual[k][0], sums.residual[k][1], sums.residual[k][2];
  }
  return residual;
}

const Matrix16& RefinementMatrix(int right, int upper) {
  static const std::array<Matrix16, 4> matrices = {MakeRefinement(0, 0), MakeRefinement(1, 0),
                                                   MakeRefinement(0, 1), MakeRefinement(1, 1)};
  return matrices[right + 2 * upper];
}

}  // namespace semblance::fitting
