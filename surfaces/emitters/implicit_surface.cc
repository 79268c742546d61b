// SPDX-License-Identifier: GPL-3.0-or-later
#include "surfaces/emitters/implicit_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "surfaces/emitters/emitter_bounds.h"
#include "surfaces/emitters/emitter_search.h"
#include "surfaces/emitters/make_emitters.h"
#include "surfaces/emitters/near_emitters.h"

namespace semblance {
namespace {

EmitterDepth DepthOver(const Emitter& emitter) {
  const auto* flat = std::get_if<FlatEmitter>(&emitter);
  return flat ? flat->depth : EmitterDepth::kMean;
}

static_assert(FlatBatch::kLanes == DistanceBatch::kLanes &&
              FlatBatch::kLanes == EmitterReach::kLanes);

// Integrals of a flat emitter by two numerical ways, each within 1 %.
constexpr double kFlatShare = 0.025;

// Of the tree's leaves, whose emitters are 8 each but for the last.
std::vector<FlatBatch> MakeFlatBatches(const std::vector<EmitterTriangle>& emitters) {
  constexpr std::size_t kLanes = FlatBatch::kLanes;
  std::vector<FlatBatch> batches((emitters.size() + kLanes - 1) / kLanes);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    const EmitterTriangle& t = emitters[e];
    FlatBatch& batch = batches[e / kLanes];
    const int lane = static_cast<int>(e % kLanes);
    batch.Set(lane, t.a, t.b, t.c, t.normal, t.gain);
    if (t.IsSloped()) {
      batch.SetSlope(lane, t.slope);
    }
  }
  return batches;
}

template <class EmitterKernel>
std::vector<DistanceBatch> MakeDistanceBatches(const EmitterKernel& kernel,
                                               const std::vector<EmitterTriangle>& emitters) {
  constexpr std::size_t kLanes = DistanceBatch::kLanes;
  std::vector<DistanceBatch> batches((emitters.size() + kLanes - 1) / kLanes);
  for (std::size_t e = 0; e < emitters.size(); ++e) {
    const EmitterTriangle& t = emitters[e];
    batches[e / kLanes].Set(static_cast<int>(e % kLanes), t.a, t.b, t.c, t.normal,
                            kernel.Advance(t), kernel.Floor(t), t.gain);
  }
  return batches;
}

// Of the cubes that share a list of what is near. With a cut a point passes quickly over what does
// not reach it, so that larger ones pay.
double CubeSize(const std::vector<EmitterTriangle>& emitters, bool cut) {
  const double of_depth = cut ? 1.5 : 0.7;
  const double sum =
      std::accumulate(emitters.begin(), emitters.end(), 0.0,
                      [](double s, const EmitterTriangle& t) { return s + t.depth_mm; });
  return of_depth * sum / static_cast<double>(emitters.size());
}

bool HasCut(const Kernel& kernel) {
  return std::visit([](const auto& k) { return k.Cut(); }, kernel) > 0;
}

}  // namespace

struct ImplicitSurface::Impl {
  Impl(const TriMesh& skull, std::span<const double> depth_mm, const ImplicitOptions& options)
      : kernel(std::visit([](const auto& o) { return MakeKernel(o); }, options.emitter)),
        emitters(MakeEmitters(skull, depth_mm, DepthOver(options.emitter), kernel)),
        search(emitters, kernel, options.tail_error),
        near_table(CubeSize(emitters, HasCut(kernel))),
        tail_error(options.tail_error),
        decay(std::visit([](const auto& k) { return k.Decay(); }, kernel)) {
    std::visit([this](const auto& k) { MakeBatches(k); }, kernel);
  }

  void MakeBatches(const FlatKernel& k) {
    if (k.Batches()) {
      flat_batches = MakeFlatBatches(emitters);
    }
  }
  template <class EmitterKernel>
  void MakeBatches(const EmitterKernel& k) {
    distance_batches = MakeDistanceBatches(k, emitters);
    batch_reaches = ReachesOf(distance_batches, k.Fall());
  }

  template <class EmitterKernel>
  NearEmittersTable::List Near(const EmitterKernel& k, const Vec3& p) const {
    return near_table.Find(p, [&](const Box3& box) {
      double left_out = 0;
      NearEmitters near = search.InBox(k, box, FarField::kClusters, left_out);
      if (!batch_reaches.empty()) {
        near.reaches = SideBySide(batch_reaches, near.runs);
      }
      return near;
    });
  }

  double Emission(const FlatKernel& k, int e, const Vec3& p) const {
    const double height = (p - emitters[e].a).dot(emitters[e].normal);
    return height > 0 ? std::min(k.Emission(emitters[e], p, height), kMostEmission) : 0;
  }
  template <class EmitterKernel>
  double Emission(const EmitterKernel& k, int e, const Vec3& p) const {
    constexpr int kLanes = DistanceBatch::kLanes;
    return EmitByDistance(distance_batches[e / kLanes], e % kLanes, p, k.Fall());
  }

  double SumOf(const FlatKernel& k, const NearEmitters& list, const Vec3& p,
               std::int64_t& evaluations) const {
    evaluations +=
        FlatKernel::kRun * std::ssize(list.runs) + ClusterBatch::kLanes * std::ssize(list.clusters);
    if (!k.Batches()) {
      return SumOneByOne(k, list, p);
    }
    return k.Sum(flat_batches, list.runs, emitters, p) +
           SumClusters(search.clusters(), list.clusters, p, k.Power());
  }
  template <int kRun, class Visit>
  void ForEachOf(const NearEmitters& list, const Visit& visit) const {
    for (const std::int32_t run : list.runs) {
      const int end = std::min<int>(kRun * (run + 1), static_cast<int>(emitters.size()));
      for (int e = kRun * run; e < end; ++e) {
        visit(e);
      }
    }
  }
  double SumOneByOne(const FlatKernel& k, const NearEmitters& list, const Vec3& p) const {
    double sum = 0;
    ForEachOf<FlatKernel::kRun>(list, [&](int e) { sum += Emission(k, e, p); });
    return sum;
  }
  template <class EmitterKernel>
  double SumOf(const EmitterKernel& k, const NearEmitters& list, const Vec3& p,
               std::int64_t& evaluations) const {
    std::int64_t reaching = 0;
    const double sum =
        SumByDistance(distance_batches, list.runs, list.reaches, p, k.Fall(), reaching);
    evaluations += EmitterKernel::kRun * reaching;
    return sum;
  }

  template <class EmitterKernel>
  double Sum(const EmitterKernel& k, const Vec3& p, std::int64_t& evaluations) const {
    return SumOf(k, *Near(k, p), p, evaluations);
  }

  Kernel kernel;
  std::vector<EmitterTriangle> emitters;
  EmitterSearch search;
  NearEmittersTable near_table;
  std::vector<FlatBatch> flat_batches;  // of the tree's leaves; or
  std::vector<DistanceBatch> distance_batches;
  std::vector<BatchReach> batch_reaches;  // of the distance batches
  double tail_error, decay;
};

ImplicitSurface::ImplicitSurface(const TriMesh& skull, std::span<const double> depth_mm,
                                 const ImplicitOptions& options)
    : impl_(std::make_unique<Impl>(skull, depth_mm, options)) {}
ImplicitSurface::~ImplicitSurface() = default;
ImplicitSurface::ImplicitSurface(ImplicitSurface&&) noexcept = default;

double ImplicitSurface::Value(const Vec3& p) const {
  std::int64_t evaluations = 0;
  return std::visit([&](const auto& kernel) { return impl_->Sum(kernel, p, evaluations); },
                    impl_->kernel) -
         1;
}

double ImplicitSurface::Flattened(const Vec3& p) const {
  std::int64_t evaluations = 0;
  return Flattened(p, evaluations);
}

double ImplicitSurface::Flattened(const Vec3& p, std::int64_t& emitters) const {
  return Flatten(std::visit([&](const auto& kernel) { return impl_->Sum(kernel, p, emitters); },
                            impl_->kernel));
}

double ImplicitSurface::Flatten(double emission) const {
  constexpr double kLowest = -10;
  return emission > 0 ? std::max(1 - std::pow(emission, -1 / impl_->decay), kLowest) : kLowest;
}

double ImplicitSurface::SumOf(std::span<const std::int32_t> emitters, const Vec3& p) const {
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

double ImplicitSurface::SumShare() const {
  return std::holds_alternative<FlatKernel>(impl_->kernel) ? kFlatShare : 0;
}

void ImplicitSurface::BoundsIn(const Box3& box, std::span<const std::int32_t> emitters,
                               std::span<EmissionBounds> bounds) const {
  const BoxView view(box);
  const double share = SumShare() + kRounding;
  std::visit(
      [&](const auto& kernel) {
        for (std::size_t n = 0; n < emitters.size(); ++n) {
          const EmissionBounds exact = BoundsOn(kernel, impl_->emitters[emitters[n]], view);
          bounds[n] = {(1 - share) * exact.least, (1 + share) * exact.most};
        }
      },
      impl_->kernel);
}

EmissionBounds ImplicitSurface::BoundsIn(const Box3& box) const {
  double left_out = 0;
  std::vector<std::int32_t> emitters;
  std::visit(
      [&]<class EmitterKernel>(const EmitterKernel& kernel) {
        const NearEmitters near = impl_->search.InBox(kernel, box, FarField::kNone, left_out);
        impl_->ForEachOf<EmitterKernel::kRun>(near, [&](int e) { emitters.push_back(e); });
      },
      impl_->kernel);
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
  box.extend(moved);  // with the prism
  const Vec3 reach = Vec3::Constant(depth * std::pow(m, 1 / impl_->decay));
  return {box.min() - reach, box.max() + reach};
}

double ImplicitSurface::TailError() const { return impl_->tail_error; }

std::int64_t ImplicitSurface::EmittersNear(const Vec3& p) const {
  return std::visit(
      [&]<class EmitterKernel>(const EmitterKernel& kernel) {
        const std::int64_t runs = std::ssize(impl_->Near(kernel, p)->runs);
        return std::min(EmitterCount(), EmitterKernel::kRun * runs);
      },
      impl_->kernel);
}

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
    squares += t.depth_mm * t.depth_mm;  // depth^2 / area, weighted by area
    area += t.area_mm2;
  }
  return squares / area;
}

}  // namespace semblance
