// SPDX-License-Identifier: GPL-3.0-or-later
// The terms that are integrals over the surface: thin plate and membrane.
#include <cmath>
#include <memory>

#include "fitting/terms/element_stiffness.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

// The sixteen vertices at which the energy is zero: the template's, or nothing.
PatchMatrix Origin(SmoothnessOf of, const SplineElement& element) {
  return of == SmoothnessOf::kSurface ? PatchMatrix(PatchMatrix::Zero()) : element.rest;
}

// Calls `look` with each element and its stiffness, and with a root of that, which elements of one
// level share.
void ForEachElement(const auto& term, const LevelView& view, const auto& look) {
  std::shared_ptr<const Eigen::MatrixXd> root;
  ElementStiffness stiffness;
  int patches_u = -1;
  for (int e = 0; e < view.elements(); ++e) {
    const SplineElement element = view.Element(e);
    if (element.patches_u != patches_u) {
      patches_u = element.patches_u;
      stiffness = StiffnessOf(term, view.lengths_mm, patches_u, element.patches_v);
      root = std::make_shared<const Eigen::MatrixXd>(StiffnessRoot(stiffness));
    }
    look(element, stiffness, root);
  }
}

void AddEnergy(const auto& term, const LevelView& view, RowSink& sink) {
  ForEachElement(term, view,
                 [&](const SplineElement& element, const ElementStiffness&,
                     const std::shared_ptr<const Eigen::MatrixXd>& root) {
                   AddElementRows(element, root, *root * Origin(term.of, element), sink);
                 });
}

double Energy(const auto& term, const LevelView& view, const ControlNet& net) {
  double energy = 0;
  ForEachElement(term, view,
                 [&](const SplineElement& element, const ElementStiffness& stiffness, const auto&) {
                   const PatchMatrix x = element.Vertices(net) - Origin(term.of, element);
                   energy += (stiffness * x).cwiseProduct(x).sum();
                 });
  return energy;
}

}  // namespace

// weight * length^4 / area * energy of a patch.
ElementStiffness StiffnessOf(const SmoothnessTerm& term, const Vec2& lengths_mm, int patches_u,
                             int patches_v) {
  const double scale = term.weight * std::pow(term.length_mm, 4) / lengths_mm.prod();
  return scale * ThinPlateStiffness(lengths_mm.x() / patches_u, lengths_mm.y() / patches_v);
}

// weight * length^2 / area * energy of a patch.
ElementStiffness StiffnessOf(const MembraneTerm& term, const Vec2& lengths_mm, int patches_u,
                             int patches_v) {
  const double scale = term.weight * std::pow(term.length_mm, 2) / lengths_mm.prod();
  return scale * MembraneStiffness(lengths_mm.x() / patches_u, lengths_mm.y() / patches_v);
}

void AddRows(const SmoothnessTerm& term, const LevelView& view, RowSink& sink) {
  AddEnergy(term, view, sink);
}

void AddRows(const MembraneTerm& term, const LevelView& view, RowSink& sink) {
  AddEnergy(term, view, sink);
}

double TermCost(const SmoothnessTerm& term, const LevelView& view, const ControlNet& net) {
  return Energy(term, view, net);
}

double TermCost(const MembraneTerm& term, const LevelView& view, const ControlNet& net) {
  return Energy(term, view, net);
}

}  // namespace semblance
