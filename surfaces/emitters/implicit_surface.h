// SPDX-License-Identifier: GPL-3.0-or-later
// The implicit surface over a skull: the sum of its triangles' emissions, at threshold 1 (thesis
// ch. 3).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "surfaces/emitters/emitter.h"
#include "surfaces/mesh/tri_mesh.h"

namespace semblance {

struct NeighbourList;  // emitter_search.h

struct ImplicitOptions {
  Emitter emitter = FlatEmitter{};  // what a triangle emits
  double tail_error = 1e-3;         // of the far field, where 1 is the surface
};
template <class Visitor>
void Fields(Visitor& visit, ImplicitOptions& o) {
  visit(FieldInfo{.name = "emitter", .doc = "what a triangle of the skull emits"}, o.emitter);
  visit(FieldInfo{.name = "tail_error",
                  .min = 0,
                  .max = 0.1,
                  .doc = "bound on the error of the far field, which is summed by multipoles of "
                         "emitters or, where they are too far for that, left out, where 1 is the "
                         "surface; 0 sums every emitter"},
        o.tail_error);
}

// Value(p) = sum of emissions - 1: positive inside. Bounded: each emission is capped at
// 1e12, and at distances (for `flat` with a whole decay: heights) below 5 % of the depth it is
// taken as from 5 %, so that it is finite on vertices, edges and planes of emitters.
class ImplicitSurface {
 public:
  // depth_mm: one per vertex; a triangle emits with the mean of its three (thesis 3.1), or, if the
  // emitter says so, linear between them, and not at all where one is NaN. With linear depths a
  // triangle over which the depth changes by more than 15 % counts as several emitters. Throws
  // InputError if nothing emits, if a depth is not positive, or if the sizes differ.
  ImplicitSurface(const TriMesh& skull, std::span<const double> depth_mm,
                  const ImplicitOptions& options);
  ~ImplicitSurface();
  ImplicitSurface(ImplicitSurface&&) noexcept;

  double Value(const Vec3& p) const;  // safe from several threads at once

  // 1 - (Value(p) + 1)^(-1/decay), not below -10: the same sign, but over a plate of depth l it is
  // (l - h) / l at height h, so that a search for the surface is one for the zero of a line.
  double Flattened(const Vec3& p) const;
  // The same; adds to `emitters` how many it took.
  double Flattened(const Vec3& p, std::int64_t& emitters) const;
  double Flatten(double emission) const;  // of Value(p) + 1

  // One emitter at a time, for a polygonizer that sums them itself (thesis 3.2). Emitters are
  // numbered from 0 to EmitterCount() - 1.
  void EmissionsAt(const Vec3& p, std::span<const std::int32_t> emitters,
                   std::span<double> emissions) const;
  // The sum of some emissions.
  double SumOf(std::span<const std::int32_t> emitters, const Vec3& p) const;
  // The same, several at once: gathered from some emitters, given in ascending order. Neighbours in
  // the same lanes are summed too. Adds to `evaluations` how many emitters it took.
  std::shared_ptr<const NeighbourList> Gather(std::span<const std::int32_t> emitters) const;
  double SumOf(const NeighbourList& gathered, const Vec3& p, std::int64_t& evaluations) const;
  // SumOf and what Value sums may differ by this share: near emitters of `flat` are integrated
  // numerically in two ways.
  double SumShare() const;
  void BoundsIn(const Box3& box, std::span<const std::int32_t> emitters,
                std::span<EmissionBounds> bounds) const;
  // Of Value(p) + 1 in the box.
  EmissionBounds BoundsIn(const Box3& box) const;
  // The triangle, for `split` also where it is moved to and its depth (1 - t) l, with d = l m^(1/k)
  // of room each way (thesis 3.2.2): m emitters at that distance would just make a surface.
  Box3 InfluenceBox(std::int32_t emitter, double m) const;
  double TailError() const;  // by which Value may be off, either way

  std::int64_t EmitterCount() const;
  double MaxDepth_mm() const;

  // Triangles on a square of side depth, the mean over the skull's area: what drives the surface of
  // the thesis's emitters outward. With `thesis`, k = 6: 1.3 l at about 1, 2.2 l at
  // 12, 4.2 l at 200.
  double EmittersPerSquareDepth() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace semblance
