// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <memory>

#include "fitting/term_cost.h"

namespace semblance {
namespace {

const ControlNet& Anchor(const PriorTerm& term, const LevelView& view) {
  return term.towards == PriorTowards::kStart ? view.start : view.rest;
}

}  // namespace

void AddRows(const PriorTerm& term, const LevelView& view, RowSink& sink) {
  const ControlNet& anchor = Anchor(term, view);
  const double factor = std::sqrt(term.weight / static_cast<double>(anchor.vertices.size()));
  const auto a = std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Constant(1, 1, factor));
  for (std::size_t k = 0; k < anchor.vertices.size(); ++k) {
    const std::array<int, 1> vertex = {static_cast<int>(k)};
    sink.Add(a, factor * anchor.vertices[k].transpose(), vertex);
  }
}

double TermCost(const PriorTerm& term, const LevelView& view, const ControlNet& net) {
  const ControlNet& anchor = Anchor(term, view);
  double sum = 0;
  for (std::size_t k = 0; k < net.vertices.size(); ++k) {
    sum += (net.vertices[k] - anchor.vertices[k]).squaredNorm();
  }
  return term.weight * sum / static_cast<double>(net.vertices.size());
}

}  // namespace semblance
