// SPDX-License-Identifier: GPL-3.0-or-later
// A level of a whole surface, or all of its levels at once, as the problem that a solve sees.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "fitting/least_squares/patch_energy.h"
#include "fitting/least_squares/row_sink.h"
#include "fitting/problem/fit_schedule.h"
#include "fitting/problem/fit_target.h"
#include "fitting/space/hierarchical_spline_space.h"
#include "fitting/space/point_cloud.h"
#include "fitting/space/spline_element.h"
#include "surfaces/hspline/bspline.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// A point whose foot on the bone is known; all less what finer levels add to it.
struct BoneObservation {
  Observation point;
  Vec3 foot = Vec3::Constant(kNaN);       // mm
  Vec3 direction = Vec3::Constant(kNaN);  // unit, out of the bone
};

// A point of the surface, or a derivative, as a weighted sum of its degrees of freedom.
struct DofStencil {
  static constexpr int kMost = 16 * 13;  // sixteen vertices of each level
  int count = 0;
  std::array<int, kMost> index{};  // the first `count`
  std::array<double, kMost> weight{};
  Vec3 fixed = Vec3::Zero();  // mm; what dofs that do not take part add

  std::span<const int> dofs() const { return {index.data(), static_cast<std::size_t>(count)}; }
  Vec3 Apply(const ControlNet& net) const {
    Vec3 sum = fixed;
    for (int k = 0; k < count; ++k) {
      sum += weight[k] * net.vertices[index[k]];
    }
    return sum;
  }
};

// A place as its element sees it: the weights of the element's sixteen vertices.
struct LocalStencil {
  int element = -1;
  std::array<double, 16> weight{};
};

// All that the terms may look at. The dofs of a level alone are its control vertices, those of all
// levels at once the vertices of level 0 and the edited ones of finer levels (SplineElements).
struct LevelView {
  PatchGrid grid;                          // of a level alone
  ControlNet start;                        // the dofs before the solve
  ControlNet rest;                         // the template's; same size
  Vec2 lengths_mm = Vec2::Constant(kNaN);  // what [0,1] stands for along u and v, MeanLengths of
                                           // the template; > 0
  std::vector<Observation> observations;
  std::vector<BoneObservation> bone = {};
  std::vector<int> held = {};  // vertices that a PriorTerm with held_only looks at, each once
  std::vector<Observation> likely = {};  // of a prior's shape, less what finer levels add; their
                                         // weights times |d|^2 add up to the mean of |d / sd|^2

  std::shared_ptr<const SplineElements> space = nullptr;  // of all levels at once; null: `grid`

  double WeightSum() const;  // of the observations
  double LandmarkWeightSum() const;

  int elements() const;
  SplineElement Element(int element) const;
  LocalStencil LocalAt(const Vec2& uv, DerivativeOrder order = {}) const;
  DofStencil StencilAt(const Vec2& uv, DerivativeOrder order = {}) const;
  // Of the surface with these dofs, or a derivative of it.
  Vec3 PointAt(const Vec2& uv, const ControlNet& net, DerivativeOrder order = {}) const;
};

// Gives a sink rows over the sixteen vertices of an element as rows over its dofs.
void AddElementRows(const SplineElement& element, std::shared_ptr<const Eigen::MatrixXd> a, Rows3 b,
                    RowSink& sink);

struct ViewOptions {
  FitAim aim = FitAim::kSurface;
  std::span<const VertexId> held = {};  // of any level
};

// The level as it stands, with the points of the target in their order. If it aims at the whole
// surface, what finer levels add at a point is taken off it. rest: the placed template, of the same
// shape. Throws InputError for a level that the surface does not have, or another shape.
LevelView ViewOfLevel(const HSplineSurface& surface, const HSplineSurface& rest,
                      const FitTarget& target, int level, const ViewOptions& options = {});

// In the order of the cloud that was made of them: those of a patch together, and the order in
// which they were given without effect.
void SortObservations(const PointCloud& cloud, std::vector<Observation>& observations);

// All levels as they stand, with the points of the target in the order of its cloud, in which those
// of a leaf stand together. lengths_mm: of the template. Keeps a reference to the space, which must
// not be edited.
LevelView ViewOfSpace(const HierarchicalSplineSpace& space, const PointCloud& cloud,
                      const FitTarget& target, const Vec2& lengths_mm);

}  // namespace semblance
