// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/space/spline_element.h"

namespace semblance {
namespace {

SplineElement ElementOf(const HierarchicalSplineSpace& space, int leaf,
                        const std::vector<int>& dof_of_space) {
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
      if (dof_of_space[dof] < 0) {
        element.fixed += refinement.col(k) * space.dofs()[dof].value.transpose();
      } else {
        element.dofs.push_back(dof_of_space[dof]);
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
  std::vector<int> dof_of_space(space.dofs().size(), -1);
  for (std::size_t k = 0; k < space.dofs().size(); ++k) {
    if (!space.dofs()[k].covered) {
      dof_of_space[k] = dofs();
      of_space_.push_back(static_cast<int>(k));
    }
  }
  for (std::size_t k = 0; k < space.nodes().size(); ++k) {
    if (space.nodes()[k].children < 0) {
      element_of_[k] = size();
      elements_.push_back(ElementOf(space, static_cast<int>(k), dof_of_space));
    }
  }
}

ControlNet SplineElements::NetOf(const std::vector<Vec3>& of_all) const {
  ControlNet net{.columns = dofs(), .rows = 1, .vertices = {}};
  for (const int k : of_space_) {
    net.vertices.push_back(of_all[k]);
  }
  return net;
}

ControlNet SplineElements::Values() const {
  std::vector<Vec3> values;
  for (const ControlDof& dof : space_.dofs()) {
    values.push_back(dof.value);
  }
  return NetOf(values);
}

ControlNet SplineElements::RestValues() const { return NetOf(space_.RestValues()); }

Eigen::MatrixX3d SplineElements::StepTo(const ControlNet& values) const {
  Eigen::MatrixX3d step =
      Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(space_.dofs().size()), 3);
  for (std::size_t k = 0; k < of_space_.size(); ++k) {
    step.row(of_space_[k]) = values.vertices[k] - space_.dofs()[of_space_[k]].value;
  }
  return step;
}

}  // namespace semblance
