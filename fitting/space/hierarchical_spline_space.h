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
  int row = -1;               // among the unknowns; -1: it stays, for the finer vertices that it is
                              // a sum of are all dofs
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
  // start and rest: of one shape. All offsets of both are dofs. A level alone is the space of a
  // surface that has no other (PatchGrid::Shape). Keeps references to rest and cloud.
  HierarchicalSplineSpace(const HSplineSurface& start, const HSplineSurface& rest,
                          const PointCloud& cloud);

  const HSplineShape& shape() const { return shape_; }
  const std::vector<ControlDof>& dofs() const { return dofs_; }
  const std::vector<QuadtreeNode>& nodes() const { return nodes_; }
  int rows() const { return rows_; }  // unknowns
  int finest() const;                 // level with a dof

  // Makes vertices of levels >= 1 dofs, if they are not yet; the surface stays. Patches are
  // split down to the finest vertex whose support they share.
  void Edit(std::span<const VertexId> vertices);
  bool IsEdited(const VertexId& vertex) const;
  int RowOf(const VertexId& vertex) const;  // -1: none, or it stays
  int LeafAt(const Vec2& uv) const;         // node whose patch holds it

  // The unknowns by row, as a net of one row: as they stand, and in the template.
  void SetValues(const ControlNet& net);
  ControlNet Values() const;
  ControlNet RestValues() const;

  // Brings the sums of the leaves up to date. factors: of the points' weights, in the cloud's
  // order, or empty; with factors moments are taken anew. squares: null, or |e|^2 of each point.
  void Measure(std::vector<double> factors, int threads, std::vector<double>* squares);
  double Squares() const;  // of w |e|^2 over all points
  // What a leaf's points, as measured, add to the normal equations of its sixteen vertices.
  Matrix16 GramOf(const QuadtreeNode& leaf) const;
  PatchMatrix ResidualOf(const QuadtreeNode& leaf) const;

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
  void MeasureLeaf(const PointFactors& each, QuadtreeNode& leaf) const;
  const double* FactorsOf(const QuadtreeNode& leaf) const;  // null: none

  HSplineShape shape_;
  const HSplineSurface& rest_;
  const PointCloud& cloud_;
  std::vector<ControlDof> dofs_;
  int rows_ = 0;
  std::vector<double> factors_;  // of the last measurement
  std::unordered_map<Key, int> dof_of_;
  std::vector<QuadtreeNode> nodes_;
  std::unordered_map<Key, int> node_of_;
};

struct SplineElement {
  PatchId patch;
  int patches_u = 0;  // of its level
  int patches_v = 0;
  std::vector<int> dofs;  // unknowns: columns of the extraction; one may appear twice
  // The patch's vertices are extraction * dofs + fixed. 16 x dofs; 16 x 0 stands for the identity.
  Eigen::Matrix<double, 16, Eigen::Dynamic> extraction{16, 0};
  PatchMatrix fixed = PatchMatrix::Zero();  // mm; of dofs that do not take part
  PatchMatrix rest = PatchMatrix::Zero();   // the template's vertices, mm

  bool IsIdentity() const { return extraction.cols() == 0; }
  PatchMatrix Vertices(const ControlNet& net) const;  // net: the values of all dofs
};

// The leaves of a space as it stands, over its unknowns.
class SplineElements {
 public:
  // Keeps a reference to the space, which must not be edited.
  explicit SplineElements(const HierarchicalSplineSpace& space);

  int size() const { return static_cast<int>(elements_.size()); }
  const SplineElement& operator[](int element) const { return elements_[element]; }
  int At(const Vec2& uv) const { return element_of_[space_.LeafAt(uv)]; }

  const HSplineShape& shape() const { return space_.shape(); }
  const VertexId& Vertex(int row) const { return vertices_[row]; }

 private:
  const HierarchicalSplineSpace& space_;
  std::vector<SplineElement> elements_;
  std::vector<int> element_of_;     // of each node, or -1
  std::vector<VertexId> vertices_;  // of each unknown
};

}  // namespace semblance
