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
  std::vector<int> dofs;  // columns of the extraction; one may stand twice
  // The patch's vertices are extraction * dofs + fixed. 16 x dofs; 16 x 0 stands for the identity.
  Eigen::Matrix<double, 16, Eigen::Dynamic> extraction{16, 0};
  PatchMatrix fixed = PatchMatrix::Zero();  // mm; of dofs that do not take part
  PatchMatrix rest = PatchMatrix::Zero();   // the template's vertices, mm

  bool IsIdentity() const { return extraction.cols() == 0; }
  PatchMatrix Vertices(const ControlNet& net) const;  // net: the values of all dofs
};

// The leaves of a space as it stands, over those of its dofs that are not covered.
class SplineElements {
 public:
  // Keeps a reference to the space, which must not be edited.
  explicit SplineElements(const HierarchicalSplineSpace& space);

  int size() const { return static_cast<int>(elements_.size()); }
  const SplineElement& operator[](int element) const { return elements_[element]; }
  int At(const Vec2& uv) const { return element_of_[space_.LeafAt(uv)]; }

  const HSplineShape& shape() const { return space_.shape(); }
  int dofs() const { return static_cast<int>(of_space_.size()); }
  const VertexId& Vertex(int dof) const { return space_.dofs()[of_space_[dof]].vertex; }
  // The values of the dofs as a net of one row: where the space has them, and in the template.
  ControlNet Values() const;
  ControlNet RestValues() const;
  // What takes the space's dofs to these values: rows of HierarchicalSplineSpace::Move.
  Eigen::MatrixX3d StepTo(const ControlNet& values) const;

 private:
  ControlNet NetOf(const std::vector<Vec3>& of_all) const;

  const HierarchicalSplineSpace& space_;
  std::vector<SplineElement> elements_;
  std::vector<int> element_of_;  // of each node, or -1
  std::vector<int> of_space_;    // each dof's index in the space
};

}  // namespace semblance
