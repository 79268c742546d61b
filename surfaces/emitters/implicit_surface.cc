// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/implicit_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "surfaces/emitters/distance_kernel.h"
#include "surfaces/emitters/emission_bounds.h"
#include "surfaces/emitters/emitter_search.h"
#include "surfaces/emitters/emitter_triangle.h"
#include "surfaces/emitters/flat_kernel.h"
#include "surfaces/mesh/solid.h"

namespace semblance::surfaces {
namespace {

using AnyKernel = std::variant<FlatKernel, DistanceKernel>;

AnyKernel MakeKernel(const FlatEmitter& o) { return FlatKernel(o); }
AnyKernel MakeKernel(const SplitEmitter& o) { return DistanceKernel(o); }
AnyKernel MakeKernel(const ThesisEmitter& o) { return DistanceKernel(o); }

EmitterDepth DepthOver(const Emitter& emitter) {
  const auto* flat = std::get_if<FlatEmitter>(&emitter);
  return flat ? flat->depth : EmitterDepth::kMean;
}

// Largest relative difference between two quadratures of a flat emitter, each within 1 %, with a
// margin.
constexpr double kFlatShare = 0.025;
// The same for depths that are linear over a triangle: seen from about one edge away, their
// second-order weights err more (found with triangles as wide as the tissue is thick).
constexpr double kSlopedShare = 0.1;

double FindSumShare(const AnyKernel& kernel, std::span<const EmitterTriangle> emitters) {
  if (!std::holds_alternative<FlatKernel>(kernel)) {
    return 0;
  }
  return std::ranges::any_of(emitters, &EmitterTriangle::IsSloped) ? kSlopedShare : kFlatShare;
}

void SetGains(const AnyKernel& kernel, std::vector<EmitterTriangle>& emitters) {
  std::visit(
      [&emitters](const auto& k) {
        for (EmitterTriangle& t : emitters) {
          t.gain = k.Gain(t);
          t.most_gain = t.gain * std::pow(t.most_share, k.Decay());
          t.moved = k.Advance(t) * t.normal;
        }
      },
      kernel);
}

std::vector<EmitterTriangle> MakeEmittersWithGains(const TriMesh& skull,
                                                   std::span<const double> depth_mm,
                                                   EmitterDepth over_triangle,
                                                   const AnyKernel& kernel) {
  std::vector<EmitterTriangle> emitters = MakeEmitters(skull, depth_mm, over_triangle);
  SetGains(kernel, emitters);
  return emitters;
}

EmitterSearchOptions SearchOptions(const AnyKernel& kernel, double tail_error) {
  return std::visit(
      [tail_error]<class EmitterKernel>(const EmitterKernel& k) {
        EmitterSearchOptions options{k.Fall(), EmitterKernel::kRun, false, tail_error};
        if constexpr (std::is_same_v<EmitterKernel, FlatKernel>) {
          options.multipoles = k.HasLanes();
        }
        return options;
      },
      kernel);
}

// The size of the cubes that share a neighbour list: larger cubes need fewer but longer lists. With
// a cut a point quickly skips emitters that do not reach it, so that larger cubes pay.
double CubeSize(const std::vector<EmitterTriangle>& emitters, bool cut) {
  const double of_depth = cut ? 1.5 : 0.7;
  const double sum =
      std::accumulate(emitters.begin(), emitters.end(), 0.0,
                      [](double s, const EmitterTriangle& t) { return s + t.depth_mm; });
  return of_depth * sum / static_cast<double>(emitters.size());
}

bool HasCut(const AnyKernel& kernel) {
  return std::visit([](const auto& k) { return k.Fall().cut; }, kernel) > 0;
}

}  // namespace

struct ImplicitSurface::Impl {
  Impl(const TriMesh& skull, std::span<const double> depth_mm, const ImplicitOptions& options)
      : kernel(std::visit([](const auto& o) { return MakeKernel(o); }, options.emitter)),
        emitters(MakeEmittersWithGains(skull, depth_mm, DepthOver(options.emitter), kernel)),
        search(emitters, SearchOptions(kernel, options.tail_error)),
        neighbours(CubeSize(emitters, HasCut(kernel))),
        sum_share(FindSumShare(kernel, emitters)),
        tail_error(options.tail_error),
        decay(std::visit([](const auto& k) { return k.Decay(); }, kernel)) {
    std::visit([this](const auto& k) { MakeLanes(k); }, kernel);
    if (std::ranges::all_of(depth_mm, [](double d) { return std::isfinite(d); }) &&
        BoundsSolid(skull)) {
      solid.emplace(skull);
    }
  }

  void MakeLanes(const FlatKernel& k) {
    if (k.HasLanes()) {
      flat_lanes = k.MakeLanes(emitters);
    }
  }
  void MakeLanes(const DistanceKernel& k) {
    distance_lanes = k.MakeLanes(emitters);
    reach_balls = MakeReachBalls(distance_lanes, k.Fall());
  }

  NeighbourListCache::List Near(const Vec3& p) const {
    return neighbours.Find(p, [&](const Box3& box) {
      double left_out = 0;
      NeighbourList near = search.InBox(box, FarField::kMultipole, left_out);
      GatherReaches(near);
      return near;
    });
  }
  void GatherReaches(NeighbourList& list) const {
    if (!reach_balls.empty()) {
      list.reaches = surfaces::Gather(reach_balls, list.runs);
    }
  }

  double Emission(const FlatKernel& k, int e, const Vec3& p) const {
    const double height = (p - emitters[e].a).dot(emitters[e].normal);
    return height > 0 ? k.Emission(emitters[e], p, height) : 0;
  }
  double Emission(const DistanceKernel& k, int e, const Vec3& p) const {
    constexpr int kLanes = DistanceEmitterLanes::kLanes;
    return EmitByDistance(distance_lanes[e / kLanes], e % kLanes, p, k.Fall());
  }

  // Calls visit(e) for each emitter of a list's runs.
  template <class Visit>
  void ForEachEmitter(const NeighbourList& list, int run_length, const Visit& visit) const {
    for (const std::int32_t run : list.runs) {
      const int end = std::min<int>(run_length * (run + 1), static_cast<int>(emitters.size()));
      for (int e = run_length * run; e < end; ++e) {
        visit(e);
      }
    }
  }

  double SumEmissions(const FlatKernel& k, const NeighbourList& list, const Vec3& p,
                      std::int64_t& evaluations) const {
    evaluations += FlatKernel::kRun * std::ssize(list.runs) +
                   MultipoleLanes::kLanes * std::ssize(list.multipoles);
    if (!k.HasLanes()) {
      double sum = 0;
      ForEachEmitter(list, FlatKernel::kRun, [&](int e) { sum += Emission(k, e, p); });
      return sum;
    }
    return k.Sum(flat_lanes, list.runs, emitters, p) +
           SumMultipoles(search.multipoles(), list.multipoles, p, k.Fall().whole);
  }
  double SumEmissions(const DistanceKernel& k, const NeighbourList& list, const Vec3& p,
                      std::int64_t& evaluations) const {
    std::int64_t reaching = 0;
    const double sum =
        SumByDistance(distance_lanes, list.runs, list.reaches, p, k.Fall(), reaching);
    evaluations += reaching;
    return sum;
  }

  // The sum over all emitters at p, within the tail error.
  double Sum(const Vec3& p, std::int64_t& evaluations) const {
    return Sum(*Near(p), p, evaluations);
  }
  double Sum(const NeighbourList& list, const Vec3& p, std::int64_t& evaluations) const {
    return std::visit([&](const auto& k) { return SumEmissions(k, list, p, evaluations); }, kernel);
  }

  bool IsSolid(const Vec3& p) const { return solid && solid->Contains(p); }

  int RunLength() const {
    return std::visit([]<class EmitterKernel>(const EmitterKernel&) { return EmitterKernel::kRun; },
                      kernel);
  }

  AnyKernel kernel;
  std::vector<EmitterTriangle> emitters;
  EmitterSearch search;
  NeighbourListCache neighbours;
  std::vector<FlatEmitterLanes> flat_lanes;          // per eight emitters, for `flat`
  std::vector<DistanceEmitterLanes> distance_lanes;  // per eight emitters, else
  std::vector<ReachBall> reach_balls;                // per half of distance_lanes
  std::optional<Solid> solid;                        // if the skull is closed and emits everywhere
  double sum_share, tail_error, decay;
};

ImplicitSurface::ImplicitSurface(const TriMesh& skull, std::span<const double> depth_mm,
                                 const ImplicitOptions& options)
    : impl_(std::make_unique<Impl>(skull, depth_mm, options)) {}
ImplicitSurface::~ImplicitSurface() = default;
ImplicitSurface::ImplicitSurface(ImplicitSurface&&) noexcept = default;

double ImplicitSurface::Value(const Vec3& p) const {
  std::int64_t evaluations = 0;
  const double emission = impl_->Sum(p, evaluations);
  return (emission <= 1 && impl_->IsSolid(p) ? kMaxEmission : emission) - 1;
}

double ImplicitSurface::Flattened(const Vec3& p) const {
  std::int64_t evaluations = 0;
  return Flattened(p, evaluations);
}

double ImplicitSurface::Flattened(const Vec3& p, std::int64_t& emitters) const {
  return FlattenAt(p, impl_->Sum(p, emitters));
}

double ImplicitSurface::FlattenAt(const Vec3& p, double emission) const {
  constexpr double kLowest = -10;
  if (emission <= 1 && impl_->IsSolid(p)) {
    return 1;
  }
  return emission > 0 ? std::max(1 - std::pow(emission, -1 / impl_->decay), kLowest) : kLowest;
}

double ImplicitSurface::SumEmissions(std::span<const std::int32_t> emitters, const Vec3& p) const {
  return std::visit(
      [&](const auto& kernel) {
        double sum = 0;
        for (const std::int32_t e : emitters) {
          sum += impl_->Emission(kernel, e, p);
        }
        return sum;
      },
      impl_->kernel);
}

void ImplicitSurface::EmissionsAt(const Vec3& p, std::span<const std::int32_t> emitters,
                                  std::span<double> emissions) const {
  std::visit(
      [&](const auto& kernel) {
        for (std::size_t n = 0; n < emitters.size(); ++n) {
          emissions[n] = impl_->Emission(kernel, emitters[n], p);
        }
      },
      impl_->kernel);
}

std::shared_ptr<const NeighbourList> ImplicitSurface::Gather(
    std::span<const std::int32_t> emitters) const {
  NeighbourList list;
  for (const std::int32_t e : emitters) {
    const int run = e / impl_->RunLength();
    if (list.runs.empty() || list.runs.back() != run) {
      list.runs.push_back(run);
    }
  }
  impl_->GatherReaches(list);
  return std::make_shared<const NeighbourList>(std::move(list));
}

double ImplicitSurface::SumEmissions(const NeighbourList& gathered, const Vec3& p,
                                     std::int64_t& evaluations) const {
  return impl_->Sum(gathered, p, evaluations);
}

double ImplicitSurface::SumShare() const { return impl_->sum_share; }

void ImplicitSurface::BoundsIn(const Box3& box, std::span<const std::int32_t> emitters,
                               std::span<EmissionBounds> bounds) const {
  const BoxView view(box);
  const double share = SumShare() + kRounding;
  std::visit(
      [&](const auto& kernel) {
        for (std::size_t n = 0; n < emitters.size(); ++n) {
          const EmissionBounds exact = BoundsOn(kernel, impl_->emitters[emitters[n]], view);
          bounds[n] = {(1 - share) * exact.least, (1 + share) * exact.most, exact.least_at_corner};
        }
      },
      impl_->kernel);
}

EmissionBounds ImplicitSurface::BoundsIn(const Box3& box) const {
  double left_out = 0;
  const NeighbourList near = impl_->search.InBox(box, FarField::kNone, left_out);
  std::vector<std::int32_t> emitters;
  impl_->ForEachEmitter(near, impl_->RunLength(), [&](int e) { emitters.push_back(e); });
  std::vector<EmissionBounds> bounds(emitters.size());
  BoundsIn(box, emitters, bounds);
  EmissionBounds sum{-impl_->tail_error, left_out + impl_->tail_error};
  for (const EmissionBounds& one : bounds) {
    sum.least += one.least;
    sum.most += one.most;
  }
  return sum;
}

Box3 ImplicitSurface::InfluenceBox(std::int32_t emitter, double m) const {
  const EmitterTriangle& t = impl_->emitters[emitter];
  Box3 box;
  box.extend(t.a).extend(t.b).extend(t.c);
  const double depth =
      std::visit([&t](const auto& kernel) { return kernel.EmittingDepth(t); }, impl_->kernel);
  const Box3 moved = box.translated(t.moved);
  box.extend(moved);  // includes the prism
  const Vec3 reach = Vec3::Constant(depth * std::pow(m, 1 / impl_->decay));
  return {box.min() - reach, box.max() + reach};
}

double ImplicitSurface::TailError() const { return impl_->tail_error; }

std::int64_t ImplicitSurface::EmitterCount() const {
  return static_cast<std::int64_t>(impl_->emitters.size());
}

double ImplicitSurface::MaxDepth_mm() const {
  double deepest = 0;
  for (const EmitterTriangle& t : impl_->emitters) {
    deepest = std::max(deepest, t.depth_mm);
  }
  return deepest;
}

double ImplicitSurface::EmittersPerSquareDepth() const {
  double squares = 0, area = 0;
  for (const EmitterTriangle& t : impl_->emitters) {
    squares += t.depth_mm * t.depth_mm;  // depth^2 / area, weighted by the area
    area += t.area_mm2;
  }
  return squares / area;
}

}  // namespace semblance::surfaces
