// SPDX-License-Identifier: GPL-3.0-or-later
// The hierarchical spline space: an H-spline whose levels are all fitted at once. It consists of a
// quadtree of patches, and of degrees of freedom (dofs): the vertices of level 0 and the edited
// vertices of finer levels. The surface is linear in the dofs. (Multi-level extraction: D'Angella,
// Kollmannsberger, Rank & Reali 2018.)
//
// States. A leaf is measured if its sums belong to the present surface, points and weights.
//
//                Edit, SetValues, Rebin (some leaves)
//             +----------------------------------------+
//             v                                        |
//   create -> STALE ------------- Measure ------> MEASURED --> readers: Squares, LeafGram,
//                                                              LeafResidual, MarkForRefinement
//
//   Edit(vertices)    adds dofs of value 0 and splits patches. The surface stays the same.
//   SetValues(net)    moves the surface. The quadtree and the dofs stay.
//   Rebin()           assigns the points to patches again; required after a change of the cloud.
//   Measure(factors)  brings the sums of all leaves up to date for these factors of the weights.
//
// An adaptive fit refines the space as follows (space_solve.h, refinement_marking.h):
//
//   Measure -> solve, SetValues -> Measure -> MarkForRefinement --none--> done
//      ^                                             |
//      +-------------------- Edit <------vertices----+
//
// Invariants, which functions refer to by number.
//   1. A parent stands before its children in nodes(). The first patches_u * patches_v nodes are
//      the patches (i, j) of level 0, at i + patches_u * j.
//   2. A node has no children, or four consecutive ones; child (right, upper) is children + right
//      + 2 * upper. Hence the leaves tile the domain.
//   3. Every patch in the support of a dof has a node. Hence the surface is one bicubic polynomial
//      on each leaf.
//   4. node.vertices = refinement(parent.vertices) + the values of node.dofs. `rest` holds the
//      template's vertices, and the template's offsets are dofs too.
//   5. A dof has no row if and only if all finer vertices whose sum it is are dofs as well. It
//      then keeps its value, and the rows number the remaining dofs in their order.
//   6. node.range holds the points of the cloud in the patch. The ranges of four children
//      partition their parent's.
//   7. If leaf.measured, then sums.residual, squares and largest belong to leaf.vertices and the
//      factors of the last measurement. If leaf.has_moments, then sums.moments belong to the
//      points with factors 1.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "fitting/space/patch_moments.h"
#include "surfaces/hspline/hspline_surface.h"

namespace semblance::fitting {

// A degree of freedom: the position of a vertex of level 0, or the displacement of an edited vertex
// from its place on the refined coarser net.
struct ControlDof {
  VertexId vertex;
  Vec3 value = Vec3::Zero();  // mm
  int row = -1;               // number among the unknowns; -1: the dof is fixed (invariant 5)
};

struct QuadtreeNode {
  PatchId patch;
  int parent = -1;
  int children = -1;  // first of four (invariant 2); -1: a leaf
  PointCloud::Range range;
  std::array<int, 16> dofs;  // dofs at the patch's sixteen vertices, or -1
  PatchMatrix vertices;      // positions, mm
  PatchMatrix rest;          // the template's positions, mm
  PatchMoments sums;         // of a leaf (invariant 7)
  bool has_moments = false;  // invariant 7
  bool measured = false;     // invariant 7
};

class HierarchicalSplineSpace {
 public:
  // start and rest have the same shape, and all offsets of both become dofs. A single level is the
  // space of a surface with one level (PatchGrid::Shape). Keeps references to rest and cloud.
  HierarchicalSplineSpace(const HSplineSurface& start, const HSplineSurface& rest,
                          const PointCloud& cloud);

  const HSplineShape& shape() const { return shape_; }
  const std::vector<ControlDof>& dofs() const { return dofs_; }
  const std::vector<QuadtreeNode>& nodes() const { return nodes_; }
  int rows() const { return rows_; }  // number of unknowns
  int finest() const;                 // finest level with a dof

  // Makes vertices of levels >= 1 dofs, unless they are already. The surface does not change.
  // Splits every patch in the support of a new dof down to the dof's level (invariant 3).
  void Edit(std::span<const VertexId> vertices);
  bool IsEdited(const VertexId& vertex) const;
  int FindRow(const VertexId& vertex) const;  // row of its unknown; -1: none
  int LeafAt(const Vec2& uv) const;           // index of the leaf whose patch holds uv

  // The unknowns in the order of their rows, as a net with a single row of vertices.
  void SetValues(const ControlNet& net);
  ControlNet Values() const;
  ControlNet RestValues() const;  // the template's

  // Brings the sums of the leaves up to date. factors: multiply the points' weights, in the cloud's
  // order; empty: all 1. With factors the moments are computed again. squares: null, or receives
  // |e|^2 of each point.
  void Measure(std::vector<double> factors, int threads, std::vector<double>* squares);
  double Squares() const;  // sum of w |e|^2 over all points
  // The contributions of a measured leaf's points to the normal equations of its sixteen vertices.
  Matrix16 LeafGram(const QuadtreeNode& leaf) const;
  PatchMatrix LeafResidual(const QuadtreeNode& leaf) const;

  // Assigns the points to patches again. Call it after the cloud was rebuilt from moved points.
  void Rebin();

  // The surface as offsets in the frames of coarser levels. Throws InputError where a coarser level
  // has no frame.
  HSplineSurface Surface() const;

 private:
  using Key = std::uint64_t;
  static Key MakeKey(int level, int i, int j) {
    return (static_cast<Key>(level) << 40) | (static_cast<Key>(i) << 20) | static_cast<Key>(j);
  }
  int AddDof(const VertexId& vertex, const Vec3& value);
  int AddNode(const PatchId& patch, int parent, const PointCloud::Range& range);
  int EnsureNode(const PatchId& patch);
  void Split(int node);
  bool IsCovered(const VertexId& vertex) const;
  void LinkDofs();
  void Refresh();
  void MeasureLeaf(const PointFactors& each, QuadtreeNode& leaf) const;
  const double* LeafFactors(const QuadtreeNode& leaf) const;  // null: all 1

  HSplineShape shape_;
  const HSplineSurface& rest_;
  const PointCloud& cloud_;
  std::vector<ControlDof> dofs_;
  int rows_ = 0;
  std::vector<double> factors_;  // those of the last measurement
  std::unordered_map<Key, int> dof_of_;
  std::vector<QuadtreeNode> nodes_;
  std::unordered_map<Key, int> node_of_;
};

// A leaf as a function of the unknowns: its sixteen B-spline vertices are extraction * unknowns +
// fixed.
struct SplineElement {
  PatchId patch;
  int patches_u = 0;  // of the patch's level
  int patches_v = 0;
  std::vector<int> dofs;  // unknowns of the extraction's columns; one may appear twice
  Eigen::Matrix<double, 16, Eigen::Dynamic> extraction{16, 0};  // 16 x 0: the identity
  PatchMatrix fixed = PatchMatrix::Zero();  // mm; contribution of the fixed dofs
  PatchMatrix rest = PatchMatrix::Zero();   // the template's vertices, mm

  bool IsIdentity() const { return extraction.cols() == 0; }
  PatchMatrix Vertices(const ControlNet& net) const;  // net: the values of all unknowns
};

// The leaves of a space as elements over its unknowns.
class SplineElements {
 public:
  // Keeps a reference to the space, which must not be edited afterwards.
  explicit SplineElements(const HierarchicalSplineSpace& space);

  int size() const { return static_cast<int>(elements_.size()); }
  const SplineElement& operator[](int element) const { return elements_[element]; }
  int At(const Vec2& uv) const { return element_of_[space_.LeafAt(uv)]; }

  const HSplineShape& shape() const { return space_.shape(); }
  const VertexId& Vertex(int row) const { return vertices_[row]; }

 private:
  const HierarchicalSplineSpace& space_;
  std::vector<SplineElement> elements_;
  std::vector<int> element_of_;     // per node; -1: not a leaf
  std::vector<VertexId> vertices_;  // per unknown
};

}  // namespace semblance::fitting
