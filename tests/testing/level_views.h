// SPDX-License-Identifier: GPL-3.0-or-later
// A fit of one level on a small open sheet, and an instance of each term, for law tests.
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "fitting/solve/space_solve.h"
#include "surfaces/base/random.h"
#include "tests/testing/shapes.h"
#include "tests/testing/splines.h"

namespace semblance::testing {
using namespace problems;

// A wavy sheet of 80 x 60 mm with random vertices of +- roughness.
inline ControlNet Sheet(int m, int n, double roughness_mm, std::uint64_t random_seed) {
  Random random(random_seed);
  ControlNet net{.columns = m + 3, .rows = n + 3, .vertices = {}};
  for (int j = 0; j < net.rows; ++j) {
    for (int i = 0; i < net.columns; ++i) {
      net.vertices.push_back(Vec3(80.0 * (i - 1) / m, 60.0 * (j - 1) / n, 5 * std::sin(i)) +
                             random.InBox(-roughness_mm, roughness_mm));
    }
  }
  return net;
}

// `count` points of `truth` at random (u,v) with u <= u_max.
inline std::vector<Observation> Observe(const ControlNet& truth, int count,
                                        std::uint64_t random_seed, double noise_mm = 0,
                                        double u_max = 1) {
  Random random(random_seed);
  std::vector<Observation> observations;
  for (int k = 0; k < count; ++k) {
    const Vec2 uv(random.Uniform(0, u_max), random.Uniform(0, 1));
    const Stencil s = PlainStencil(truth.columns - 3, truth.rows - 3, uv);
    observations.push_back({.uv = uv,
                            .position = s.Apply(truth) + random.InBox(-noise_mm, noise_mm),
                            .weight = random.Uniform(0.5, 2)});
  }
  return observations;
}

inline LevelView View(const ControlNet& start, std::vector<Observation> observations) {
  LevelView view{.grid = {.patches_u = start.columns - 3, .patches_v = start.rows - 3},
                 .start = start,
                 .rest = Sheet(start.columns - 3, start.rows - 3, 0, 0),
                 .lengths_mm = {},
                 .observations = std::move(observations)};
  view.lengths_mm = MeanLengths(view.grid, view.rest);
  SortObservations(PointCloud(view.grid.Shape(), view.observations), view.observations);
  return view;
}

template <std::size_t... I>
std::vector<Term> EveryTerm(std::index_sequence<I...>) {
  return {Term(std::in_place_index<I>)...};
}

// One term of each kind with its defaults, and further terms with other options.
inline std::vector<Term> AllTerms() {
  std::vector<Term> terms = EveryTerm(std::make_index_sequence<std::variant_size_v<Term>>());
  for (Term& term : terms) {
    if (auto* const rows = std::get_if<RowsTerm>(&term)) {
      // Weak, because the rows contradict the points: the cost that remains decides when Ceres
      // stops.
      rows->weight = 0.01;
      for (int k = 0; k < 20; ++k) {  // all over the domain
        const double u = 0.05 + 0.225 * (k % 5), v = 0.05 + 0.3 * (k / 5);
        rows->rows.push_back({.at = {{u, v, 0, 0, 1}}, .equals = {5, -3, 2.0 + k}});
        rows->rows.push_back(
            {.at = {{u, v, 1, 0, 0.02}, {1 - u, v, 0, 2, -0.002}}, .equals = {1, 0, 0.5}});
      }
    }
  }
  terms.push_back(PointTerm{.weight = 2, .loss = RobustLoss::kHuber, .loss_width_mm = 1});
  terms.push_back(PointTerm{.weight = 2, .loss = RobustLoss::kCauchy, .loss_width_mm = 2});
  terms.push_back(PointTerm{.weight = 2, .loss = RobustLoss::kTukey, .loss_width_mm = 30});
  terms.push_back(TangentPointTerm{.weight = 2, .tangential = 0.5});
  terms.push_back(SymmetryTerm{.weight = 0.2, .of = SmoothnessOf::kSurface});
  terms.push_back(DistortionTerm{.weight = 2, .of = DistortionOf::kArea, .length_mm = 20});
  terms.push_back(PriorTerm{.weight = 3, .towards = PriorTowards::kTemplate});
  terms.push_back(SmoothnessTerm{.weight = 0.2, .of = SmoothnessOf::kSurface, .length_mm = 20});
  terms.push_back(SmoothnessTerm{.weight = 0.2, .stretch = 3, .direction_deg = 40});
  terms.push_back(MembraneTerm{.weight = 0.2, .of = SmoothnessOf::kSurface, .length_mm = 20});
  return terms;
}

// A bone 4 mm below every observation, however the sheet bends.
inline void StandOnBone(LevelView& view) {
  for (const Observation& o : view.observations) {
    view.bone.push_back({o, o.position - Vec3(0, 0, 4), Vec3(0, 0, 1)});
  }
}

// A prior's shape 2 mm above the template, with a smaller sd at one end than at the other.
inline void LayShape(LevelView& view) {
  for (const Observation& o : Observe(view.rest, 50, 7)) {
    view.likely.push_back(
        {.uv = o.uv, .position = o.position + Vec3(0, 0, 2), .weight = (0.2 + o.uv.x()) / 50});
  }
}

// 320 points on 12 patches, enough in each to be reduced; every twentieth is a landmark.
inline LevelView NoisyView() {
  LevelView view = View(Sheet(4, 3, 2, 1), Observe(Sheet(4, 3, 3, 2), 320, 3, 1));
  for (std::size_t k = 0; k < view.observations.size(); k += 20) {
    view.observations[k].landmark = true;
  }
  StandOnBone(view);
  LayShape(view);
  return view;
}

}  // namespace semblance::testing
