// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/space/patch_moments.h"

#include <algorithm>
#include <array>

#include "surfaces/hspline/bspline_basis.h"

// Also as code for newer processors, chosen when the program starts; products and sums are never
// fused (-ffp-contract=off), so both give the same bytes. Not under sanitizers.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__clang__)
#define SEMBLANCE_KERNEL __attribute__((target_clones("avx2", "default"), noinline))
#else
#define SEMBLANCE_KERNEL
#endif

namespace semblance {
namespace {

using Vec4 = double __attribute__((vector_size(32)));

// Coefficients of 1, z, z^2, z^3, z = 2 s - 1, of the four B-spline segments on s in [0,1].
constexpr double kSegment[4][4] = {
    {1, -3, 3, -1}, {23, -15, -3, 3}, {23, 15, -3, -3}, {1, 3, 3, 1}};

// Row k: coefficients of z_u^a z_v^b, at a + 4 b, of the weight of vertex k.
Matrix16 MakePowers() {
  Matrix16 powers;
  for (int k = 0; k < 16; ++k) {
    for (int m = 0; m < 16; ++m) {
      powers(k, m) = kSegment[k % 4][m % 4] / 48 * (kSegment[k / 4][m / 4] / 48);
    }
  }
  return powers;
}

const Matrix16& PowersOfVertices() {
  static const Matrix16 powers = MakePowers();
  return powers;
}

struct Polynomial {
  Vec4 power[16];  // of z_u^a z_v^b at a + 4 b
  double scale;    // z_u = x * scale - shift_u
  double shift_u, shift_v;
};

Polynomial PolynomialOf(const PatchId& patch, const PatchMatrix& vertices) {
  const PatchMatrix powers = PowersOfVertices().transpose() * vertices;
  Polynomial p{};
  for (int m = 0; m < 16; ++m) {
    p.power[m] = Vec4{powers(m, 0), powers(m, 1), powers(m, 2), 0};
  }
  p.scale = 2.0 * (1 << patch.level);
  p.shift_u = 2.0 * patch.i + 1;
  p.shift_v = 2.0 * patch.j + 1;
  return p;
}

constexpr double kOutlier = 0.5;  // a point of a smaller factor

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

SEMBLANCE_KERNEL void Accumulate(const Batch& batch, const Polynomial& p, PatchMoments& sums) {
  Vec4 moments[7][2], residual[16];
  __builtin_memcpy(moments, sums.moments, sizeof moments);
  __builtin_memcpy(residual, sums.residual, sizeof residual);
  for (std::size_t k = 0; k < batch.count; ++k) {
    const CloudPoint& point = batch.points[k];
    const double z = point.x * p.scale - p.shift_u, y = point.y * p.scale - p.shift_v;
    const double w = batch.factors == nullptr ? point.weight : point.weight * batch.factors[k];
    Vec4 position;
    __builtin_memcpy(&position, point.position.data(), sizeof position);
    const Vec4 e = position - (((RowAt(p, 3, z) * y + RowAt(p, 2, z)) * y + RowAt(p, 1, z)) * y +
                               RowAt(p, 0, z));
    const Vec4 ee = e * e;
    const double square = ee[0] + ee[1] + ee[2];
    sums.squares += w * square;
    const bool outlier = batch.factors != nullptr && batch.factors[k] < kOutlier;
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

// A point's weights of the sixteen vertices, and its misfit.
struct PointRow {
  Eigen::Matrix<double, 16, 1> weights;
  Eigen::RowVector3d misfit;
};

PointRow RowOf(const CloudPoint& p, const PatchId& patch, const PatchMatrix& vertices) {
  const double scale = 1 << patch.level;
  const auto along_u = CubicWeights(p.x * scale - patch.i, 0),
             along_v = CubicWeights(p.y * scale - patch.j, 0);
  PointRow row;
  for (int v = 0; v < 16; ++v) {
    row.weights[v] = along_u[v % 4] * along_v[v / 4];
  }
  const Eigen::RowVector3d position(p.position[0], p.position[1], p.position[2]);
  row.misfit = position - row.weights.transpose() * vertices;
  return row;
}

double WeightOf(const CloudPoint& p, const double* factors, std::size_t k) {
  return factors == nullptr ? p.weight : p.weight * factors[k];
}

}  // namespace

void AddMoments(std::span<const CloudPoint> points, const PatchId& patch,
                const PatchMatrix& vertices, bool moments, const PointFactors& each,
                PatchMoments& sums) {
  Accumulate({points.data(), points.size(), each.factors, each.squares, moments},
             PolynomialOf(patch, vertices), sums);
}

Matrix16 GramOfMoments(const PatchMoments& sums) {
  Matrix16 of_powers;
  for (int k = 0; k < 16; ++k) {
    for (int l = 0; l < 16; ++l) {
      of_powers(k, l) = sums.moments[k / 4 + l / 4][k % 4 + l % 4];
    }
  }
  return PowersOfVertices() * of_powers * PowersOfVertices().transpose();
}

PatchMatrix ResidualOfMoments(const PatchMoments& sums) {
  PatchMatrix of_powers;
  for (int k = 0; k < 16; ++k) {
    of_powers.row(k) << sums.residual[k][0], sums.residual[k][1], sums.residual[k][2];
  }
  return PowersOfVertices() * of_powers;
}

PatchSystem SystemOfPoints(std::span<const CloudPoint> points, const PatchId& patch,
                           const PatchMatrix& vertices, const double* factors) {
  PatchSystem system;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const PointRow row = RowOf(points[k], patch, vertices);
    const Eigen::Matrix<double, 16, 1> weighted = WeightOf(points[k], factors, k) * row.weights;
    system.gram += weighted * row.weights.transpose();
    system.residual += weighted * row.misfit;
  }
  return system;
}

PatchMatrix ResidualOfPoints(std::span<const CloudPoint> points, const PatchId& patch,
                             const PatchMatrix& vertices, const double* factors) {
  PatchMatrix residual = PatchMatrix::Zero();
  for (std::size_t k = 0; k < points.size(); ++k) {
    const PointRow row = RowOf(points[k], patch, vertices);
    const Eigen::Matrix<double, 16, 1> weighted = WeightOf(points[k], factors, k) * row.weights;
    residual += weighted * row.misfit;
  }
  return residual;
}

const Matrix16& RefinementMatrix(int right, int upper) {
  static const std::array<Matrix16, 4> matrices = {MakeRefinement(0, 0), MakeRefinement(1, 0),
                                                   MakeRefinement(0, 1), MakeRefinement(1, 1)};
  return matrices[right + 2 * upper];
}

}  // namespace semblance
