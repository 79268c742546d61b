// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/schemes/simple_schemes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "interp/dowels/dowel_samples.h"

namespace semblance::interp {
namespace {

const Dowel& NearestDowel(std::span<const Dowel> dowels, const Vec3& p) {
  const Dowel* best = &dowels.front();
  double best_distance2 = (best->base - p).squaredNorm();
  for (const Dowel& dowel : dowels.subspan(1)) {
    const double distance2 = (dowel.base - p).squaredNorm();
    if (distance2 < best_distance2 || (distance2 == best_distance2 && dowel.site < best->site)) {
      best = &dowel;
      best_distance2 = distance2;
    }
  }
  return *best;
}

// The nearest dowel of each vertex; null on pieces of the skull without a dowel.
std::vector<const Dowel*> NearestAlong(const DepthInput& input, const RunContext& run) {
  std::vector<const Dowel*> by_site;
  for (const Dowel& dowel : input.dowels) {
    by_site.push_back(&dowel);
  }
  std::ranges::stable_sort(by_site, {}, [](const Dowel* d) { return d->site; });
  std::vector<DepthSample> samples;
  for (const Dowel* dowel : by_site) {
    samples.push_back({dowel->base, dowel->direction, dowel->depth_mm, dowel->sd_mm});
  }
  const std::size_t vertices = input.skull.points.size();
  std::vector<const Dowel*> nearest(vertices, nullptr);
  std::vector<double> least(vertices, std::numeric_limits<double>::infinity());
  ForEachGeodesic(Nearest::kName, input.skull, samples, run,
                  [&](std::size_t k, const std::vector<double>& distance) {
                    for (std::size_t i = 0; i < vertices; ++i) {
                      if (distance[i] < least[i]) {
                        least[i] = distance[i];
                        nearest[i] = by_site[k];
                      }
                    }
                  });
  return nearest;
}

DepthValue WeightedMean(const std::vector<DepthSample>& samples, double power, const Vec3& p) {
  double nearest2 = std::numeric_limits<double>::infinity();
  for (const DepthSample& sample : samples) {
    nearest2 = std::min(nearest2, (sample.base - p).squaredNorm());
  }
  // Weights are relative to the nearest dowel's, so that no power can overflow: they lie in [0, 1],
  // and the nearest dowel's is 1. If nearest2 = 0 all others are 0.
  double sum = 0, depth = 0, sd = 0;
  for (const DepthSample& sample : samples) {
    const double distance2 = (sample.base - p).squaredNorm();
    const double weight = distance2 == nearest2 ? 1 : std::pow(nearest2 / distance2, power / 2);
    sum += weight;
    depth += weight * sample.depth_mm;
    sd += weight * sample.sd_mm;
  }
  return {depth / sum, sd / sum};
}

struct WeightedSums {
  double weight = 0, depth = 0, sd = 0;
  bool at_base = false;

  void Add(const DepthSample& sample, double distance_mm, double power) {
    if (at_base || !std::isfinite(distance_mm)) {
      return;
    }
    at_base = distance_mm <= kSamePoint_mm;
    if (at_base) {
      *this = {1, sample.depth_mm, sample.sd_mm, true};
      return;
    }
    const double w = std::pow(distance_mm, -power);
    weight += w;
    depth += w * sample.depth_mm;
    sd += w * sample.sd_mm;
  }
};

std::vector<WeightedSums> SumsAlong(const DepthInput& input,
                                    const std::vector<DepthSample>& samples, double power,
                                    const RunContext& run) {
  std::vector<WeightedSums> sums(input.skull.points.size());
  ForEachGeodesic(InverseDistance::kName, input.skull, samples, run,
                  [&](std::size_t k, const std::vector<double>& distance) {
                    ForEachVertex(input, run, [&](std::size_t i) {
                      sums[i].Add(samples[k], distance[i], power);
                    });
                  });
  return sums;
}

}  // namespace

double MeanDepth(std::span<const Dowel> dowels) {
  double sum = 0;
  for (const Dowel& dowel : dowels) {
    sum += dowel.depth_mm;
  }
  return sum / static_cast<double>(dowels.size());
}

DepthField InterpolateDepth(const Mean&, const DepthInput& input, const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  const std::size_t vertices = input.skull.points.size();  // so that each vector is written once
  return {std::vector<double>(vertices, MeanDepth(input.dowels)),
          std::vector<DepthStatus>(vertices, DepthStatus::kAssigned),
          std::vector<double>(vertices, kNaN)};
}
DepthField InterpolateDepth(const Nearest& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  DepthField field = EmptyDepthField(input.skull.points.size());
  const bool along = options.distance == DowelDistance::kGeodesic;
  const std::vector<const Dowel*> nearest =
      along ? NearestAlong(input, run) : std::vector<const Dowel*>();
  ForEachVertex(input, run, [&](std::size_t i) {
    const Dowel* dowel = along ? nearest[i] : &NearestDowel(input.dowels, input.skull.points[i]);
    if (dowel == nullptr) {
      return;
    }
    if (!Faces(input.normals[i], dowel->direction, options.max_angle_deg)) {
      field.status[i] = DepthStatus::kNotFacing;
      return;
    }
    field.status[i] = DepthStatus::kAssigned;
    field.depth_mm[i] = dowel->depth_mm;
    field.sd_mm[i] = dowel->sd_mm;
  });
  return field;
}

DepthField InterpolateDepth(const InverseDistance& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  const std::vector<DepthSample> samples = DepthSamples(input.dowels);
  const DepthLimits limits(samples, true);
  if (options.distance == DowelDistance::kGeodesic) {
    const std::vector<WeightedSums> sums = SumsAlong(input, samples, options.power, run);
    return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
      return DepthValue{limits(sums[i].depth / sums[i].weight), sums[i].sd / sums[i].weight};
    });
  }
  return AssignWhereFacing(input, samples, options.max_angle_deg, run, [&](std::size_t i) {
    const DepthValue mean = WeightedMean(samples, options.power, input.skull.points[i]);
    return DepthValue{limits(mean.mm), mean.sd_mm};  // against round-off
  });
}

}  // namespace semblance::interp
