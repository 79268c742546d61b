// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/space/point_cloud.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <tuple>

namespace semblance::fitting {
namespace {

// Bits of the place in a level-0 patch, along each side. A key has 2 * 18 of them and 28 bits for
// the patch.
constexpr int kBits = 18;

struct Key {
  std::uint64_t value;
  std::uint32_t index;
};

// Moves bits 0, 1, 2 .. of x to positions 0, 2, 4 ..
std::uint64_t Spread(std::uint64_t x) {
  x = (x | x << 16) & 0x0000FFFF0000FFFFu;
  x = (x | x << 8) & 0x00FF00FF00FF00FFu;
  x = (x | x << 4) & 0x0F0F0F0F0F0F0F0Fu;
  x = (x | x << 2) & 0x3333333333333333u;
  return (x | x << 1) & 0x5555555555555555u;
}

std::uint64_t Cell(double s) {
  constexpr double kCells = 1 << kBits;
  return std::min(static_cast<std::uint64_t>(s * kCells), (std::uint64_t{1} << kBits) - 1);
}

std::uint64_t PatchNumber(const HSplineShape& shape, const PatchPoint& at) {
  return at.patch.i + static_cast<std::uint64_t>(shape.patches_u) * at.patch.j;
}

Key MakeKey(const HSplineShape& shape, const Vec2& uv, std::size_t index) {
  const PatchPoint at = PatchPointAt(shape, 0, uv);
  const std::uint64_t s = Cell(at.s), t = Cell(at.t),
                      z = shape.max_level == 0 ? s << kBits | t : Spread(s) | Spread(t) << 1;
  return {PatchNumber(shape, at) << (2 * kBits) | z, static_cast<std::uint32_t>(index)};
}

// Sorts by value, digit by digit, and keeps the order of equal keys.
void RadixSort(std::vector<Key>& keys) {
  constexpr int kDigit = 11;  // bits; 2^11 counters fit into the first-level cache
  std::uint64_t all = 0;
  for (const Key& key : keys) {
    all |= key.value;
  }
  std::vector<Key> other(keys.size());
  for (int shift = 0; shift < 64 && all >> shift != 0; shift += kDigit) {
    const auto digit = [&](const Key& k) { return k.value >> shift & ((1u << kDigit) - 1); };
    std::array<std::size_t, (1 << kDigit) + 1> starts{};
    for (const Key& key : keys) {
      ++starts[digit(key) + 1];
    }
    for (std::size_t d = 1; d < starts.size(); ++d) {
      starts[d] += starts[d - 1];
    }
    for (const Key& key : keys) {
      other[starts[digit(key)]++] = key;
    }
    keys.swap(other);
  }
}

// Sorts the points of one cell by their values.
void SortTies(const auto& points, std::vector<Key>& keys) {
  const auto value = [&](const Key& key) {
    const auto& p = points[key.index];
    return std::tuple(p.uv.x(), p.uv.y(), p.position.x(), p.position.y(), p.position.z(), p.weight);
  };
  for (std::size_t begin = 0, end = 0; begin < keys.size(); begin = end) {
    while (end < keys.size() && keys[end].value == keys[begin].value) {
      ++end;
    }
    if (end - begin > 1) {
      std::sort(keys.begin() + static_cast<std::ptrdiff_t>(begin),
                keys.begin() + static_cast<std::ptrdiff_t>(end),
                [&](const Key& a, const Key& b) { return value(a) < value(b); });
    }
  }
}

// Presents columns as points.
class PointRows {
 public:
  explicit PointRows(const ScatteredPoints& points) : points_(points) {}
  struct Row {
    const Vec2& uv;
    const Vec3& position;
    double weight;
  };
  std::size_t size() const { return points_.size(); }
  Row operator[](std::size_t k) const {
    return {points_.uv[k], points_.positions[k], points_.Weight(k)};
  }

 private:
  ScatteredPoints points_;
};

std::vector<Key> SortedKeys(const HSplineShape& shape, const auto& points) {
  std::vector<Key> keys;
  keys.reserve(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    keys.push_back(MakeKey(shape, points[k].uv, k));
  }
  RadixSort(keys);
  SortTies(points, keys);
  return keys;
}

CloudPoint MakePoint(const HSplineShape& shape, const auto& p) {
  const PatchPoint at = PatchPointAt(shape, 0, p.uv);
  return {.x = at.patch.i + at.s,
          .y = at.patch.j + at.t,
          .values = {p.position.x(), p.position.y(), p.position.z(), p.weight}};
}

// Sorts indices by the leading bits of their keys into buckets. starts: receives the first place of
// each bucket, and the end.
std::vector<std::uint32_t> IntoBuckets(std::span<const std::uint64_t> keys, int shift,
                                       std::vector<std::size_t>& starts) {
  const std::uint64_t largest = *std::max_element(keys.begin(), keys.end());
  starts.assign((largest >> shift) + 2, 0);
  for (const std::uint64_t key : keys) {
    ++starts[(key >> shift) + 1];
  }
  std::partial_sum(starts.begin(), starts.end(), starts.begin());
  std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t k = 0; k < keys.size(); ++k) {
    order[next[keys[k] >> shift]++] = static_cast<std::uint32_t>(k);
  }
  return order;
}

int ShiftTo16Bits(std::uint64_t bits) {
  return std::max(static_cast<int>(std::bit_width(bits)) - 16, 0);
}

}  // namespace

// Needs 12 bytes per point: a key of 8 and an index of 4.
std::vector<std::uint32_t> CurveOrder(const HSplineShape& shape, const ScatteredPoints& points) {
  std::vector<std::uint64_t> keys(points.size());
  std::uint64_t all = 0;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    keys[k] = MakeKey(shape, points.uv[k], k).value;
    all |= keys[k];
  }
  if (keys.empty()) {
    return {};
  }
  std::vector<std::size_t> starts;
  std::vector<std::uint32_t> order = IntoBuckets(keys, ShiftTo16Bits(all), starts);
  std::vector<Key> bucket;
  for (std::size_t b = 0; b + 1 < starts.size(); ++b) {
    bucket.clear();
    for (std::size_t n = starts[b]; n < starts[b + 1]; ++n) {
      bucket.push_back({keys[order[n]], order[n]});
    }
    std::sort(bucket.begin(), bucket.end(), [](const Key& a, const Key& c) {
      return std::tie(a.value, a.index) < std::tie(c.value, c.index);
    });
    SortTies(PointRows(points), bucket);
    for (std::size_t n = starts[b]; n < starts[b + 1]; ++n) {
      order[n] = bucket[n - starts[b]].index;
    }
  }
  return order;
}

template <class Points>
void PointCloud::Fill(const Points& given) {
  const std::vector<Key> keys = SortedKeys(shape_, given);
  points_.reserve(keys.size());
  given_.reserve(keys.size());
  const std::size_t patches = static_cast<std::size_t>(shape_.patches_u) * shape_.patches_v;
  starts_.reserve(patches + 1);
  for (const Key& key : keys) {
    while (starts_.size() <= key.value >> (2 * kBits)) {
      starts_.push_back(points_.size());
    }
    points_.push_back(MakePoint(shape_, given[key.index]));
    given_.push_back(key.index);
    weight_sum_ += points_.back().weight();
  }
  starts_.resize(patches + 1, points_.size());
}

PointCloud::PointCloud(const HSplineShape& shape, const FitTarget& target) : shape_(shape) {
  Fill(target.points);
}

PointCloud::PointCloud(const HSplineShape& shape, std::span<const Observation> observations)
    : shape_(shape) {
  Fill(observations);
}

PointCloud::Range PointCloud::PatchOfLevel0(int i, int j) const {
  const std::size_t patch = i + static_cast<std::size_t>(shape_.patches_u) * j;
  return {starts_[patch], starts_[patch + 1]};
}

PointCloud::Range PointCloud::Child(const Range& parent, const PatchId& child) const {
  const double scale = 1 << child.level;
  const int last_u = shape_.PatchesU(child.level) - 1, last_v = shape_.PatchesV(child.level) - 1;
  const auto place = [&](const CloudPoint& p) {  // number of its child, in the Z-curve's order
    const int i = std::min(static_cast<int>(p.x * scale), last_u),
              j = std::min(static_cast<int>(p.y * scale), last_v);
    return i % 2 + 2 * (j % 2);
  };
  const auto at = [&](int order) {
    const auto first = points_.begin() + static_cast<std::ptrdiff_t>(parent.begin),
               last = points_.begin() + static_cast<std::ptrdiff_t>(parent.end);
    return static_cast<std::size_t>(
        std::partition_point(first, last, [&](const CloudPoint& p) { return place(p) < order; }) -
        points_.begin());
  };
  const int order = child.i % 2 + 2 * (child.j % 2);
  return {at(order), at(order + 1)};
}

}  // namespace semblance::fitting
