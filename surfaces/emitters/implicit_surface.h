// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit surface over a skull: the points where the emissions of its triangles sum to 1
// (thesis ch. 3).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "surfaces/emitters/emitter.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance::surfaces {

struct NeighbourList;  // emitter_search.h

struct ImplicitOptions {
  Emitter emitter = FlatEmitter{};
  double tail_error = 1e-3;
};
template <class Visitor>
void Fields(Visitor& visit, ImplicitOptions& o) {
  visit(FieldInfo{.name = "emitter", .doc = "emission of a triangle of the skull"}, o.emitter);
  visit(
      FieldInfo{
          .name = "tail_error",
          .min = 0,
          .max = 0.1,
          .doc =
              "bound on the error of the far field, where 1 is the surface; distant emitters are "
              "summed by multipoles, and more distant ones are left out; 0 sums every emitter"},
      o.tail_error);
}

// The field Value(p) = sum of emissions - 1, positive inside. It is finite everywhere: each
// emission is at most 1e12, and distances (for `flat` with an integer decay: heights) below 5 % of
// the depth count as 5 %. The inside of a skull that bounds a solid (BoundsSolid) and has depths
// everywhere is solid: it emits 1e12. So the tissue has no second surface on the bone, and none
// where it is thinner than a cell of a polygonizer's grid.
class ImplicitSurface {
 public:
  // depth_mm: one per vertex. A triangle emits with the mean of its three depths (thesis 3.1), or
  // with depths linear between them if the emitter has EmitterDepth::kLinear; it does not emit if
  // one is NaN. A triangle whose linear depth changes by more than 15 % becomes several emitters.
  // Throws InputError if no triangle emits, a depth is not positive, or the sizes differ.
  ImplicitSurface(const TriMesh& skull, std::span<const double> depth_mm,
                  const ImplicitOptions& options);
  ~ImplicitSurface();
  ImplicitSurface(ImplicitSurface&&) noexcept;

  double Value(const Vec3& p) const;  // thread-safe

  // Flattened(p) = 1 - (Value(p) + 1)^(-1/decay), at least -10, and 1 in the solid. It has the sign
  // of Value, but over a plate of depth l it is (l - h) / l at height h. Hence a search for the
  // surface looks for the zero of a nearly linear function.
  double Flattened(const Vec3& p) const;
  // The same; adds the number of evaluated emitters to `emitters`.
  double Flattened(const Vec3& p, std::int64_t& emitters) const;
  // The same from the sum of emissions at p.
  double FlattenAt(const Vec3& p, double emission) const;

  // The emissions of single emitters, for a polygonizer that sums them itself (thesis 3.2).
  // Emitters have the numbers 0 to EmitterCount() - 1.
  void EmissionsAt(const Vec3& p, std::span<const std::int32_t> emitters,
                   std::span<double> emissions) const;
  // The sum of some emissions.
  double SumEmissions(std::span<const std::int32_t> emitters, const Vec3& p) const;
  // The same with several emitters at once: Gather takes emitters in ascending order. Neighbours in
  // the same lanes are summed too. Adds the number of evaluated emitters to `evaluations`.
  std::shared_ptr<const NeighbourList> Gather(std::span<const std::int32_t> emitters) const;
  double SumEmissions(const NeighbourList& gathered, const Vec3& p,
                      std::int64_t& evaluations) const;
  // The largest relative difference between SumEmissions and the sum of Value, which integrate near
  // emitters of `flat` by two numerical methods.
  double SumShare() const;
  void BoundsIn(const Box3& box, std::span<const std::int32_t> emitters,
                std::span<EmissionBounds> bounds) const;
  // Bounds of the sum of emissions in the box. If the sum exceeds 1 nowhere in a box, all of it
  // is solid or all of it is outside, because every sum next to the bone is larger.
  EmissionBounds BoundsIn(const Box3& box) const;
  // The box around the triangle (and, for `split`, the moved triangle), widened by d = l m^(1/k)
  // with l the emitting depth: m emitters at that distance would just make a surface (thesis
  // 3.2.2).
  Box3 InfluenceBox(std::int32_t emitter, double m) const;
  double TailError() const;  // largest error of Value

  std::int64_t EmitterCount() const;
  double MaxDepth_mm() const;

  // The mean number of triangles on a square with the depth as its side, over the skull's area. It
  // moves the surface of the thesis's emitters outward: with `thesis` and k = 6 to 1.3 l at about
  // 1, 2.2 l at 12, and 4.2 l at 200.
  double EmittersPerSquareDepth() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace semblance::surfaces
