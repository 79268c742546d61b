// SPDX-License-Identifier: GPL-3.0-or-later
// The input of one solve: a level of a surface, or all of its levels at once.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/least_squares/qr_compression.h"
#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"
#include "fitting/terms/term.h"
#include "surfaces/hspline/bspline.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// A point with a known foot on the bone. The detail that finer levels add is taken off both.
struct BoneObservation {
  Observation point;
  Vec3 foot = Vec3::Constant(kNaN);       // mm
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
};

// A point of the surface, or a derivative, as a weighted sum of the degrees of freedom (dofs).
struct DofStencil {
  static constexpr int kMaxDofs = 16 * 13;  // sixteen vertices of each of 13 levels
  int count = 0;
  std::array<int, kMaxDofs> index{};  // the first `count` are used
  std::array<double, kMaxDofs> weight{};
  Vec3 fixed = Vec3::Zero();  // mm; contribution of the vertices that are not solved for

  std::span<const int> dofs() const { return {index.data(), static_cast<std::size_t>(count)}; }
  Vec3 Apply(const ControlNet& net) const {
    Vec3 sum = fixed;
    for (int k = 0; k < count; ++k) {
      sum += weight[k] * net.vertices[index[k]];
    }
    return sum;
  }
};

// A place as weights of the sixteen vertices of its element.
struct LocalStencil {
  int element = -1;
  std::array<double, 16> weight{};
};

// Everything that the terms may use. The dofs of a single level are its control vertices. The dofs
// of all levels are the vertices of level 0 and the edited vertices of finer levels
// (SplineElements).
struct LevelView {
  PatchGrid grid;                          // patches of a single level
  ControlNet start;                        // dofs before the solve
  ControlNet rest;                         // dofs of the template; same size
  Vec2 lengths_mm = Vec2::Constant(kNaN);  // MeanLengths of the template; > 0
  std::vector<Observation> observations;
  std::vector<BoneObservation> bone = {};
  std::vector<int> held = {};  // vertices of a PriorTerm with held_only, each once
  // A prior's shape without the detail of finer levels. The sum of weight * |d|^2 is the mean of |d
  // / sd|^2.
  std::vector<Observation> likely = {};

  // The part of each row of the term `rows` that finer levels add, mm; empty: none.
  std::vector<Vec3> finer_in_rows = {};

  std::shared_ptr<const SplineElements> space = nullptr;  // all levels; null for a single level

  double WeightSum() const;  // over the observations
  double LandmarkWeightSum() const;

  int elements() const;
  SplineElement Element(int element) const;
  LocalStencil LocalAt(const Vec2& uv, DerivativeOrder order = {}) const;
  DofStencil StencilAt(const Vec2& uv, DerivativeOrder order = {}) const;
  // The point, or a derivative, of the surface with these dofs.
  Vec3 PointAt(const Vec2& uv, const ControlNet& net, DerivativeOrder order = {}) const;
};

// Adds rows over the sixteen vertices of an element to the sink as rows over its dofs.
void AddElementRows(const SplineElement& element, std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                    RowSink& sink);

struct ViewOptions {
  FitAim aim = FitAim::kSurface;
  std::span<const VertexId> held = {};  // vertices of any level
  std::span<const Term> terms = {};     // those of the fit; only the rows of a RowsTerm count
};

// Makes the view of one level with its present vertices; the points of the target keep their order.
// With FitAim::kSurface the detail that finer levels add at a point is taken off the point. `rest`
// is the placed template and has the shape of `surface`. Throws InputError for a level that the
// surface does not have, or for another shape.
LevelView MakeLevelView(const HSplineSurface& surface, const HSplineSurface& rest,
                        const FitTarget& target, int level, const ViewOptions& options = {});

// Sorts observations into the order of the cloud that was made of them. The points of a patch then
// stand together, and the given order has no effect on results.
void SortObservations(const PointCloud& cloud, std::vector<Observation>& observations);

// Makes the view of all levels with their present vertices. The points stand in the order of the
// cloud, so those of a leaf stand together. lengths_mm: MeanLengths of the template. Keeps a
// reference to the space, which must not be edited afterwards.
LevelView MakeSpaceView(const HierarchicalSplineSpace& space, const PointCloud& cloud,
                        const FitTarget& target, const Vec2& lengths_mm);

}  // namespace semblance::fitting
