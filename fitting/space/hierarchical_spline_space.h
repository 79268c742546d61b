// SPDX-License-Identifier: GPL-3.0-or-later
// An H-spline while all of its levels are fitted at once: a quadtree of patches, and the vertices
// of level 0 and the edited ones of finer levels as the degrees of freedom (dofs) of one linear
// problem.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "fitting/space/patch_moments.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance {

// A vertex of level 0, or what an edited vertex adds to its place on the refined
// coarser net. The surface is linear in all of them.
struct ControlDof {
  VertexId vertex;
  Vec3 value = Vec3::Zero();  // mm
  bool covered = false;       // the finer vertices that it is a sum of are all dofs: it may stay
};

struct QuadtreeNode {
  PatchId patch;
  int parent = -1;
  int children = -1;  // the first of four, v-major; -1: a leaf
  PointCloud::Range range;
  std::array<int, 16> dofs;  // of this level, or -1
  PatchMatrix vertices;      // absolute, mm
  PatchMatrix rest;          // of the template
  PatchMoments sums;         // of a leaf, at `vertices`
  bool has_moments = false;
  bool measured = false;  // sums.residual belongs to `vertices`
};

class HierarchicalSplineSpace {
 public:
  // start and rest: of one shape. All offsets of `start` are dofs.
  HierarchicalSplineSpace(const HSplineSurface& start, const HSplineSurface& rest,
                          const PointCloud& cloud);

  const HSplineShape& shape() const { return shape_; }
  const std::vector<ControlDof>& dofs() const { return dofs_; }
  const std::vector<QuadtreeNode>& nodes() const { return nodes_; }
  int finest() const;  // level with an dof

  // Makes vertices of levels >= 1 dofs, if they are not yet; the surface stays. Patches are
  // split down to the finest vertex whose support they share.
  void Edit(std::span<const VertexId> vertices);
  bool IsEdited(const VertexId& vertex) const;
  int LeafAt(const Vec2& uv) const;  // node whose patch holds it

  // Adds a row (mm) to each dof.
  void Move(const Eigen::MatrixX3d& step);
  // The values that the dofs have in the template.
  std::vector<Vec3> RestValues() const;

  // Brings the sums of the leaves up to date. factors: of the points' weights, in the cloud's
  // order, or empty; with factors moments are taken anew. squares: null, or |e|^2 of each point.
  void Measure(std::span<const double> factors, int threads, std::vector<double>* squares);
  double Squares() const;  // of w |e|^2 over all points

  // After the cloud was made anew, of points that have moved.
  void Rebin();

  // The surface as offsets in the frames of coarser levels. Throws InputError where it has none.
  HSplineSurface Surface() const;

 private:
  using Key = std::uint64_t;
  static Key KeyOf(int level, int i, int j) {
    return (static_cast<Key>(level) << 40) | (static_cast<Key>(i) << 20) | static_cast<Key>(j);
  }
  int AddDof(const VertexId& vertex, const Vec3& value);
  int AddNode(const PatchId& patch, int parent, const PointCloud::Range& range);
  int EnsureNode(const PatchId& patch);
  void Split(int node);
  bool IsCovered(const VertexId& vertex) const;
  void LinkDofs();
  void Refresh();

  HSplineShape shape_;
  const HSplineSurface& rest_;
  const PointCloud& cloud_;
  std::vector<ControlDof> dofs_;
  std::unordered_map<Key, int> dof_of_;
  std::vector<QuadtreeNode> nodes_;
  std::unordered_map<Key, int> node_of_;
};

}  // namespace semblance
