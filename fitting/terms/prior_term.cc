// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <memory>

#include "fitting/terms/term_cost.h"

namespace semblance {
namespace {

const ControlNet& Anchor(const PriorTerm& term, const LevelView& view) {
  return term.towards == PriorTowards::kStart ? view.start : view.rest;
}

// Calls `look` with each vertex that the term holds.
void ForEach(const PriorTerm& term, const LevelView& view, const auto& look) {
  const std::size_t count = term.held_only ? view.held.size() : view.start.vertices.size();
  for (std::size_t k = 0; k < count; ++k) {
    look(term.held_only ? view.held[k] : static_cast<int>(k));
  }
}

}  // namespace

void AddRows(const PriorTerm& term, const LevelView& view, RowSink& sink) {
  const ControlNet& anchor = Anchor(term, view);
  const double factor = std::sqrt(term.weight / static_cast<double>(anchor.vertices.size()));
  const auto a = std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Constant(1, 1, factor));
  ForEach(term, view,
          [&](int k) { sink.Add(a, factor * anchor.vertices[k].transpose(), std::array{k}); });
}

double TermCost(const PriorTerm& term, const LevelView& view, const ControlNet& net) {
  const ControlNet& anchor = Anchor(term, view);
  double sum = 0;
  ForEach(term, view, [&](int k) { sum += (net.vertices[k] - anchor.vertices[k]).squaredNorm(); });
  return term.weight * sum / static_cast<double>(net.vertices.size());
}

}  // namespace semblance
