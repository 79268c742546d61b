// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/depth_truth.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "surfaces/base/error.h"
#include "surfaces/base/geometry.h"
#include "surfaces/base/parallel.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

struct Measured {
  double depth_mm = kNaN;
  TruthStatus status = TruthStatus::kValid;
};

class TruthMeter {
 public:
  TruthMeter(const TriMesh& skin, const DepthTruthOptions& options)
      : skin_(skin),
        options_(options),
        query_(skin),
        least_cosine_(std::cos(options.max_grazing_deg * std::numbers::pi / 180)) {}

  // A ray may start outside an inner wall. Skin through which the ray enters is not the skin of its
  // vertex.
  Measured Along(const Vec3& p, const Vec3& direction) const {
    const auto hit = query_.FirstHit(p, direction, options_.max_depth_mm);
    if (!hit) {
      return {kNaN, TruthStatus::kNoHit};
    }
    const double cosine = UnitNormal(hit->triangle).dot(direction);
    if (cosine <= 0) {
      return {kNaN, TruthStatus::kNoHit};
    }
    return cosine < least_cosine_ ? Measured{kNaN, TruthStatus::kGrazing}
                                  : Measured{hit->distance_mm, TruthStatus::kValid};
  }

  Measured Closest(const Vec3& p, const Vec3& direction) const {
    const MeshPoint closest = query_.Closest(p);
    if (closest.distance_mm > options_.max_depth_mm) {
      return {kNaN, TruthStatus::kTooFar};
    }
    if ((closest.position - p).dot(direction) < 0) {
      return {kNaN, TruthStatus::kBehind};
    }
    return UnitNormal(closest.triangle).dot(direction) < least_cosine_
               ? Measured{kNaN, TruthStatus::kGrazing}
               : Measured{closest.distance_mm, TruthStatus::kValid};
  }

 private:
  Vec3 UnitNormal(int triangle) const {
    return TriangleAreaVector(skin_, skin_.triangles[triangle]).normalized();
  }

  const TriMesh& skin_;
  DepthTruthOptions options_;
  MeshQuery query_;
  double least_cosine_;
};

TruthMap EmptyMap(std::size_t vertices) {
  return {std::vector<double>(vertices, kNaN),
          std::vector<TruthStatus>(vertices, TruthStatus::kNoDirection)};
}

void Put(const Measured& measured, std::size_t vertex, TruthMap& map) {
  map.depth_mm[vertex] = measured.depth_mm;
  map.status[vertex] = measured.status;
}

}  // namespace

std::string_view DescribeStatus(TruthStatus status) {
  switch (status) {
    case TruthStatus::kValid:
      return "";
    case TruthStatus::kNoDirection:
      return "the bone has no direction there";
    case TruthStatus::kNoHit:
      return "no skin along the normal";
    case TruthStatus::kTooFar:
      return "no skin near";
    case TruthStatus::kGrazing:
      return "the skin is met at a grazing angle";
    case TruthStatus::kBehind:
      return "the closest skin is behind the bone";
  }
  return "";
}

DepthTruth MeasureDepthTruth(const TriMesh& skull, std::span<const Vec3> directions,
                             const TriMesh& skin, const DepthTruthOptions& options,
                             const RunContext& run) {
  constexpr std::size_t kBlock = 256;
  const std::size_t vertices = skull.points.size();
  if (directions.size() != vertices) {
    throw InputError(
        fmt::format("true depth: {} directions for {} vertices; there must be one per vertex",
                    directions.size(), vertices));
  }
  const TruthMeter meter(skin, options);
  DepthTruth truth{EmptyMap(vertices), EmptyMap(vertices)};
  ParallelFor(vertices, run.threads, kBlock, [&](std::size_t v) {
    if (v % kBlock == 0) {
      run.ThrowIfStopped();
    }
    if (directions[v].squaredNorm() > 0) {
      Put(meter.Along(skull.points[v], directions[v]), v, truth.along_direction);
      Put(meter.Closest(skull.points[v], directions[v]), v, truth.closest);
    }
  });
  return truth;
}

}  // namespace semblance::interp
