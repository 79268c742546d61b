// SPDX-License-Identifier: GPL-3.0-or-later
// The terms that are integrals over the surface: thin plate and membrane.
#include <array>
#include <cmath>
#include <memory>

#include "fitting/terms/smoothness_form.h"
#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

PatchForm ScaledForm(const auto& term, const LevelView& view) {
  return FormOf(term, view.lengths_mm, view.grid.patches_u, view.grid.patches_v);
}

// The net at which the energy is zero: the template, or nothing.
ControlNet Origin(SmoothnessOf of, const LevelView& view) {
  ControlNet origin = view.rest;
  if (of == SmoothnessOf::kSurface) {
    origin.vertices.assign(origin.vertices.size(), Vec3::Zero());
  }
  return origin;
}

void AddForm(const PatchForm& form, const ControlNet& origin, const PatchGrid& grid,
             RowSink& sink) {
  const auto root = std::make_shared<const Eigen::MatrixXd>(FormRoot(form));
  for (int j = 0; j < grid.patches_v; ++j) {
    for (int i = 0; i < grid.patches_u; ++i) {
      const std::array<int, 16> vertices = grid.PatchVertices(i, j);
      Eigen::Matrix<double, 16, 3> x0;
      for (int k = 0; k < 16; ++k) {
        x0.row(k) = origin.vertices[vertices[k]];
      }
      sink.Add(root, *root * x0, vertices);
    }
  }
}

double Energy(const PatchForm& form, const ControlNet& origin, const PatchGrid& grid,
              const ControlNet& net) {
  ControlNet displacement = net;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    displacement.vertices[k] -= origin.vertices[k];
  }
  return FormEnergy(form, grid, displacement);
}

}  // namespace

// weight * length^4 / area * energy of a patch.
PatchForm FormOf(const SmoothnessTerm& term, const Vec2& lengths_mm, int patches_u, int patches_v) {
  const double scale = term.weight * std::pow(term.length_mm, 4) / lengths_mm.prod();
  return scale * ThinPlateForm(lengths_mm.x() / patches_u, lengths_mm.y() / patches_v);
}

// weight * length^2 / area * energy of a patch.
PatchForm FormOf(const MembraneTerm& term, const Vec2& lengths_mm, int patches_u, int patches_v) {
  const double scale = term.weight * std::pow(term.length_mm, 2) / lengths_mm.prod();
  return scale * MembraneForm(lengths_mm.x() / patches_u, lengths_mm.y() / patches_v);
}

void AddRows(const SmoothnessTerm& term, const LevelView& view, RowSink& sink) {
  AddForm(ScaledForm(term, view), Origin(term.of, view), view.grid, sink);
}

void AddRows(const MembraneTerm& term, const LevelView& view, RowSink& sink) {
  AddForm(ScaledForm(term, view), Origin(term.of, view), view.grid, sink);
}

double TermCost(const SmoothnessTerm& term, const LevelView& view, const ControlNet& net) {
  return Energy(ScaledForm(term, view), Origin(term.of, view), view.grid, net);
}

double TermCost(const MembraneTerm& term, const LevelView& view, const ControlNet& net) {
  return Energy(ScaledForm(term, view), Origin(term.of, view), view.grid, net);
}

}  // namespace semblance
