// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/nested/leaf_sums.h"

#include <cmath>
#include <cstring>

#include "fitting/nested/lanes.h"
#include "surfaces/base/simd.h"

namespace semblance::fitting {
namespace {

// The products of two of four weights, each pair once. The remaining places are zero and fill the
// registers.
constexpr int kPairs = 10, kRoom = 12;
constexpr std::array<std::array<int, 4>, 4> kPair = {
    {{0, 1, 2, 3}, {1, 4, 5, 6}, {2, 5, 7, 8}, {3, 6, 8, 9}}};
using Pairs = double[kPairs][kRoom];

Matrix16 MakeGram(const Pairs& sums) {
  Matrix16 gram;
  for (int k = 0; k < 16; ++k) {
    for (int l = 0; l < 16; ++l) {
      gram(k, l) = sums[kPair[k / 4][l / 4]][kPair[k % 4][l % 4]];
    }
  }
  return gram;
}

// A leaf's points, and the map from their places to the leaf.
struct LeafPoints {
  const NestedPoints& points;
  const std::uint32_t* indices;
  std::size_t count;
  double scale, first_u, first_v;
};

LeafPoints MakeLeafPoints(const NestedPoints& points, const LeafPatch& leaf,
                          std::span<const std::uint32_t> indices) {
  return {.points = points,
          .indices = indices.data(),
          .count = indices.size(),
          .scale = static_cast<double>(1 << leaf.level),
          .first_u = static_cast<double>(leaf.i),
          .first_v = static_cast<double>(leaf.j)};
}

SEMBLANCE_INLINE void MakePairs(const double* weights, double factor, double* pairs) {
  int at = 0;
  for (int a = 0; a < 4; ++a) {
    for (int b = a; b < 4; ++b) {
      pairs[at++] = factor * weights[a] * weights[b];
    }
  }
}

// A block of points of a leaf, small enough for the first-level cache.
template <int channels>
struct Block {
  static constexpr int kCapacity = 32;  // points
  int count = 0;
  alignas(64) double pairs_u[kCapacity][kRoom] = {};
  alignas(64) double pairs_v[kCapacity][kPairs];  // times the point's weight
  alignas(64) double both[kCapacity][16];
  alignas(64) double values[kCapacity][channels + 1];  // the probe last
};

template <int channels>
SEMBLANCE_INLINE void Put(const LeafPoints& leaf, std::uint32_t k, Block<channels>& block,
                          LeafSums& all) {
  const int n = block.count++;
  double u[4], v[4];
  const double w = leaf.points.Weight(k);
  WeightsAt(leaf.points.X(k) * leaf.scale - leaf.first_u, u);
  WeightsAt(leaf.points.Y(k) * leaf.scale - leaf.first_v, v);
  MakePairs(u, 1, block.pairs_u[n]);
  MakePairs(v, w, block.pairs_v[n]);
  for (int m = 0; m < 16; ++m) {
    block.both[n][m] = u[m % 4] * v[m / 4];
  }
  for (int c = 0; c < channels; ++c) {
    block.values[n][c] = w * leaf.points.value[k][c];
    all.squares += block.values[n][c] * leaf.points.value[k][c];
  }
  block.values[n][channels] = std::sqrt(w) * ProbeSign(k);
  all.weight += w;
}

// Adds factors[n][r] times the four numbers of across[n] from `first` on to row r of the sums. The
// rows stay in registers during the loop over the points, and each row adds the points in their
// order.
template <int rows, int room>
SEMBLANCE_INLINE void AddProducts(const double (*factors)[rows], const double (*across)[room],
                                  int first, int count, double (*sums)[room]) {
  Wide sum[rows];
  for (int r = 0; r < rows; ++r) {
    std::memcpy(&sum[r], sums[r] + first, sizeof(Wide));
  }
  for (int n = 0; n < count; ++n) {
    Wide some;
    std::memcpy(&some, across[n] + first, sizeof(Wide));
    for (int r = 0; r < rows; ++r) {
      sum[r] += factors[n][r] * some;
    }
  }
  for (int r = 0; r < rows; ++r) {
    std::memcpy(sums[r] + first, &sum[r], sizeof(Wide));
  }
}

template <int channels>
SEMBLANCE_INLINE void AddBlock(const Block<channels>& block, Pairs& sums, double (*right)[16]) {
  for (int first = 0; first < kRoom; first += kLaneCount<Wide>) {
    AddProducts<kPairs, kRoom>(block.pairs_v, block.pairs_u, first, block.count, sums);
  }
  for (int first = 0; first < 16; first += kLaneCount<Wide>) {
    AddProducts<channels + 1, 16>(block.values, block.both, first, block.count, right);
  }
}

template <int channels>
SEMBLANCE_INLINE void AddPoints(const LeafPoints& leaf, Pairs& sums, LeafSums& all) {
  Block<channels> block;
  alignas(64) double right[channels + 1][16] = {};
  for (std::size_t n = 0; n < leaf.count; ++n) {
    Put<channels>(leaf, leaf.indices[n], block, all);
    if (block.count == Block<channels>::kCapacity || n + 1 == leaf.count) {
      AddBlock<channels>(block, sums, right);
      block.count = 0;
    }
  }
  std::memcpy(all.right.data(), right, sizeof right);
}

SEMBLANCE_WIDE void AddPointsOf1(const LeafPoints& leaf, Pairs& sums, LeafSums& all) {
  AddPoints<1>(leaf, sums, all);
}
SEMBLANCE_WIDE void AddPointsOf2(const LeafPoints& leaf, Pairs& sums, LeafSums& all) {
  AddPoints<2>(leaf, sums, all);
}
SEMBLANCE_WIDE void AddPointsOf3(const LeafPoints& leaf, Pairs& sums, LeafSums& all) {
  AddPoints<3>(leaf, sums, all);
}

template <int channels>
SEMBLANCE_INLINE void ComputeResiduals(const LeafPoints& leaf, const LeafVertices& vertices,
                                       NestedResidual* residuals) {
  Wide rows[channels][4];
  std::memcpy(rows, vertices.data(), sizeof rows);
  double u[4], v[4];
  for (std::size_t n = 0; n < leaf.count; ++n) {
    const std::uint32_t k = leaf.indices[n];
    WeightsAt(leaf.points.X(k) * leaf.scale - leaf.first_u, u);
    WeightsAt(leaf.points.Y(k) * leaf.scale - leaf.first_v, v);
    const Wide along_u = {u[0], u[1], u[2], u[3]};
    for (int c = 0; c < channels; ++c) {
      Wide sum = {};
      for (int b = 0; b < 4; ++b) {
        sum += v[b] * rows[c][b];
      }
      sum *= along_u;
      residuals[n].along[c] = leaf.points.value[k][c] - ((sum[0] + sum[1]) + (sum[2] + sum[3]));
    }
  }
}

SEMBLANCE_WIDE void ComputeResidualsOf1(const LeafPoints& leaf, const LeafVertices& vertices,
                                        NestedResidual* residuals) {
  ComputeResiduals<1>(leaf, vertices, residuals);
}
SEMBLANCE_WIDE void ComputeResidualsOf2(const LeafPoints& leaf, const LeafVertices& vertices,
                                        NestedResidual* residuals) {
  ComputeResiduals<2>(leaf, vertices, residuals);
}
SEMBLANCE_WIDE void ComputeResidualsOf3(const LeafPoints& leaf, const LeafVertices& vertices,
                                        NestedResidual* residuals) {
  ComputeResiduals<3>(leaf, vertices, residuals);
}

}  // namespace

double ProbeSign(std::uint32_t k) {
  std::uint64_t bits = (k + 1) * 0x9E3779B97F4A7C15u;
  bits = (bits ^ bits >> 29) * 0xBF58476D1CE4E5B9u;
  return ((bits ^ bits >> 32) & 1) != 0 ? 1 : -1;
}

LeafSums SumsOver(const NestedPoints& points, const LeafPatch& leaf,
                  std::span<const std::uint32_t> indices) {
  constexpr void (*kAdd[])(const LeafPoints&, Pairs&, LeafSums&) = {AddPointsOf1, AddPointsOf2,
                                                                    AddPointsOf3};
  alignas(64) Pairs pairs = {};
  LeafSums sums;
  kAdd[points.channels - 1](MakeLeafPoints(points, leaf, indices), pairs, sums);
  sums.gram = MakeGram(pairs);
  return sums;
}

void ResidualsOver(const NestedPoints& points, const LeafPatch& leaf, const LeafVertices& vertices,
                   std::span<const std::uint32_t> indices, NestedResidual* residuals) {
  constexpr void (*kCompute[])(const LeafPoints&, const LeafVertices&, NestedResidual*) = {
      ComputeResidualsOf1, ComputeResidualsOf2, ComputeResidualsOf3};
  kCompute[points.channels - 1](MakeLeafPoints(points, leaf, indices), vertices, residuals);
}

}  // namespace semblance::fitting
