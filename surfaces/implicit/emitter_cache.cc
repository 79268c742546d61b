// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/implicit/emitter_cache.h"

#include <bit>
#include <cstddef>
#include <utility>

namespace semblance {

EmitterCache::EmitterCache(const ImplicitSurface& surface, const SampleGrid& grid, int size)
    : surface_(surface),
      grid_(grid),
      size_(size),
      depths_(std::countr_zero(static_cast<unsigned>(size))),
      layers_(depths_ + 2) {}

EmitterCache::Kept& EmitterCache::At(const GridIndex& corner) {
  const int k = corner[2];
  Layer& layer =
      k == 0 ? layers_.back() : layers_[depths_ - std::countr_zero(static_cast<unsigned>(k))];
  if (layer.k != k) {
    layer.k = k;
    layer.corners.clear();
  }
  return layer.corners[corner[0] + std::int64_t{size_ + 1} * corner[1]];
}

void EmitterCache::Get(const GridIndex& corner, std::span<const std::int32_t> emitters,
                       std::span<double> values, std::int64_t& evaluations) {
  Kept& kept = At(corner);
  Kept fresh;
  std::vector<std::size_t> missing;  // of `emitters`
  std::size_t next = 0;              // of the kept ones
  for (std::size_t n = 0; n < emitters.size(); ++n) {
    while (next < kept.emitters.size() && kept.emitters[next] < emitters[n]) {
      ++next;
    }
    if (next < kept.emitters.size() && kept.emitters[next] == emitters[n]) {
      values[n] = kept.values[next];
    } else {
      missing.push_back(n);
      fresh.emitters.push_back(emitters[n]);
    }
  }
  if (missing.empty()) {
    return;
  }
  fresh.values.resize(missing.size());
  surface_.EmissionsAt(grid_.Corner(corner), fresh.emitters, fresh.values);
  evaluations += std::ssize(missing);
  for (std::size_t m = 0; m < missing.size(); ++m) {
    values[missing[m]] = fresh.values[m];
  }
  Insert(fresh, kept);
}

void EmitterCache::Insert(const Kept& fresh, Kept& kept) const {
  Kept both;
  both.emitters.reserve(kept.emitters.size() + fresh.emitters.size());
  both.values.reserve(both.emitters.capacity());
  std::size_t next = 0;  // of the fresh ones
  const auto append_fresh = [&] {
    both.emitters.push_back(fresh.emitters[next]);
    both.values.push_back(fresh.values[next++]);
  };
  for (std::size_t n = 0; n < kept.emitters.size(); ++n) {
    while (next < fresh.emitters.size() && fresh.emitters[next] < kept.emitters[n]) {
      append_fresh();
    }
    both.emitters.push_back(kept.emitters[n]);
    both.values.push_back(kept.values[n]);
  }
  while (next < fresh.emitters.size()) {
    append_fresh();
  }
  kept = std::move(both);
}

}  // namespace semblance
