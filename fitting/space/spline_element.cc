// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/space/spline_element.h"

namespace semblance {
namespace {

SplineElement ElementOf(const HierarchicalSplineSpace& space, int leaf) {
  const std::vector<QuadtreeNode>& nodes = space.nodes();
  SplineElement element;
  element.patch = nodes[leaf].patch;
  element.patches_u = space.shape().PatchesU(element.patch.level);
  element.patches_v = space.shape().PatchesV(element.patch.level);
  element.rest = nodes[leaf].rest;
  std::vector<Eigen::Matrix<double, 16, 1>> columns;
  Matrix16 refinement = Matrix16::Identity();  // of an ancestor's vertices
  for (int node = leaf; node >= 0; node = nodes[node].parent) {
    for (int k = 0; k < 16; ++k) {
      const int dof = nodes[node].dofs[k];
      if (dof < 0) {
        continue;
      }
      const ControlDof& unknown = space.dofs()[dof];
      if (unknown.row < 0) {
        element.fixed += refinement.col(k) * unknown.value.transpose();
      } else {
        element.dofs.push_back(unknown.row);
        columns.emplace_back(refinement.col(k));
      }
    }
    const PatchId& patch = nodes[node].patch;
    refinement = refinement * RefinementMatrix(patch.i % 2, patch.j % 2);
  }
  element.extraction.resize(16, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k) {
    element.extraction.col(static_cast<Eigen::Index>(k)) = columns[k];
  }
  return element;
}

}  // namespace

PatchMatrix SplineElement::Vertices(const ControlNet& net) const {
  Eigen::MatrixX3d values(dofs.size(), 3);
  for (std::size_t k = 0; k < dofs.size(); ++k) {
    values.row(static_cast<Eigen::Index>(k)) = net.vertices[dofs[k]];
  }
  return IsIdentity() ? PatchMatrix(values) : PatchMatrix(extraction * values + fixed);
}

SplineElements::SplineElements(const HierarchicalSplineSpace& space)
    : space_(space), element_of_(space.nodes().size(), -1) {
  for (const ControlDof& dof : space.dofs()) {
    if (dof.row >= 0) {
      vertices_.push_back(dof.vertex);
    }
  }
  for (std::size_t k = 0; k < space.nodes().size(); ++k) {
    if (space.nodes()[k].children < 0) {
      element_of_[k] = size();
      elements_.push_back(ElementOf(space, static_cast<int>(k)));
    }
  }
}

}  // namespace semblance
