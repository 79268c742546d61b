// SPDX-License-Identifier: GPL-3.0-or-later
// The patches on which a surface is one bicubic polynomial, and how their sixteen B-spline vertices
// follow from the degrees of freedom of a hierarchical space (multi-level extraction; D'Angella,
// Kollmannsberger, Rank & Reali 2018).
#pragma once

#include <vector>

#include "fitting/space/hierarchical_spline_space.h"

namespace semblance {

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
