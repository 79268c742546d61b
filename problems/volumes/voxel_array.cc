// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/volumes/voxel_array.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "surfaces/base/error.h"

namespace semblance {
namespace {

// The file's axis that becomes each of the volume's, and whether it is turned about.
struct AxisOrder {
  std::array<int, 3> from = {0, 1, 2};
  std::array<bool, 3> turned = {false, false, false};

  bool AsItStands() const {
    return from == std::array{0, 1, 2} && turned == std::array{false, false, false};
  }
};

// The order in which the unit steps are nearest to +x, +y, +z.
AxisOrder NearestOrder(const Mat3& units) {
  AxisOrder best;
  double most = -1;
  std::array<int, 3> from = {0, 1, 2};
  do {
    double sum = 0;
    for (int a = 0; a < 3; ++a) {
      sum += std::abs(units(a, from[a]));
    }
    if (sum > most + 1e-9) {
      most = sum;
      best.from = from;
    }
  } while (std::next_permutation(from.begin(), from.end()));
  for (int a = 0; a < 3; ++a) {
    best.turned[a] = units(a, best.from[a]) < 0;
  }
  return best;
}

std::vector<std::int16_t> Reordered(const VoxelArray& array, const AxisOrder& order,
                                    const CtVolume& volume) {
  const std::array<std::ptrdiff_t, 3> stride = {
      1, array.counts[0], static_cast<std::ptrdiff_t>(array.counts[0]) * array.counts[1]};
  std::ptrdiff_t first = 0;
  std::array<std::ptrdiff_t, 3> step;
  for (int a = 0; a < 3; ++a) {
    const int f = order.from[a];
    step[a] = order.turned[a] ? -stride[f] : stride[f];
    first += order.turned[a] ? stride[f] * (array.counts[f] - 1) : 0;
  }
  std::vector<std::int16_t> values(array.values.size());
  auto out = values.begin();
  for (int k = 0; k < volume.slices; ++k) {
    for (int j = 0; j < volume.rows; ++j) {
      const std::int16_t* const line = array.values.data() + first + k * step[2] + j * step[1];
      for (int i = 0; i < volume.columns; ++i) {
        *out++ = line[i * step[0]];
      }
    }
  }
  return values;
}

}  // namespace

CtVolume ToCtVolume(VoxelArray array, const std::string& where) {
  const Vec3 spacing = array.steps.colwise().norm();
  if (!array.steps.allFinite() || !(spacing.minCoeff() > 0)) {
    throw InputError(fmt::format("{}: a spacing of {} x {} x {} mm is not usable; each must be > 0",
                                 where, spacing.x(), spacing.y(), spacing.z()));
  }
  const AxisOrder order = NearestOrder(array.steps * spacing.cwiseInverse().asDiagonal());
  CtVolume volume;
  volume.origin = array.origin;
  std::array<int*, 3> counts = {&volume.columns, &volume.rows, &volume.slices};
  for (int a = 0; a < 3; ++a) {
    const int f = order.from[a];
    const Vec3 step = array.steps.col(f);
    *counts[a] = array.counts[f];
    volume.spacing_mm[a] = spacing[f];
    volume.axes.col(a) = (order.turned[a] ? -1 : 1) * step / spacing[f];
    if (order.turned[a]) {
      volume.origin += (array.counts[f] - 1) * step;
    }
  }
  const std::size_t voxels = volume.Index(0, 0, volume.slices);
  if (array.values.size() == voxels && !order.AsItStands()) {
    volume.values = Reordered(array, order, volume);
  } else {
    volume.values = std::move(array.values);
  }
  CheckVolume(volume, where);
  return volume;
}

}  // namespace semblance
