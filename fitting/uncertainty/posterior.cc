// SPDX-License-Identifier: GPL-3.0-or-later
#include "fitting/uncertainty/posterior.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <variant>

#include "fitting/least_squares/noise_sink.h"
#include "fitting/least_squares/normal_equations.h"
#include "fitting/level/auto_weight.h"
#include "fitting/terms/level_view.h"
#include "fitting/terms/term_cost.h"
#include "fitting/uncertainty/subspace.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance {
namespace {

void Check(const LevelView& view, std::span<const double> sd_mm, std::span<const Term> terms) {
  if (sd_mm.size() != view.observations.size()) {
    throw InputError(fmt::format("posterior: {} standard deviations for {} points; give one each",
                                 sd_mm.size(), view.observations.size()));
  }
  for (std::size_t k = 0; k < sd_mm.size(); ++k) {
    if (!(std::isfinite(sd_mm[k]) && sd_mm[k] > 0)) {
      throw InputError(fmt::format(
          "posterior: the standard deviation of point {} is {} mm; give a positive number", k,
          sd_mm[k]));
    }
  }
  for (const Term& term : terms) {
    const auto usable = [](const auto& t) { return t.weight <= 0 || IsSeparable(t); };
    if (!std::visit(usable, term)) {
      throw InputError(fmt::format(
          "posterior: the term '{}' has a robust loss or couples the coordinates; leave it out or "
          "take points without a loss",
          TermName(term)));
    }
  }
}

// In whatever order the points are given.
double SortedSum(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return std::accumulate(values.begin(), values.end(), 0.0);
}

double PointWeight(std::span<const Term> terms) {
  double sum = 0;
  for (const Term& term : terms) {
    const auto* const points = std::get_if<PointTerm>(&term);
    sum += points == nullptr ? 0 : points->weight;
  }
  return sum;
}

// What makes a term's cost a sum of squares in units of its deviation: a point counts
// weight * w / sum(w) in the fit and 1 / sd^2 here.
double PriorScale(const LevelView& view, std::span<const double> sd_mm,
                  std::span<const Term> terms) {
  std::vector<double> weights, variances;
  for (std::size_t k = 0; k < sd_mm.size(); ++k) {
    weights.push_back(view.observations[k].weight);
    variances.push_back(weights.back() * sd_mm[k] * sd_mm[k]);
  }
  const double count = static_cast<double>(sd_mm.size()), points = PointWeight(terms);
  return count > 0 && points > 0
             ? SortedSum(weights) / points / (SortedSum(std::move(variances)) / count)
             : 1;
}

void AddPoints(LevelView view, std::span<const double> sd_mm, RowSink& sink) {
  std::vector<double> weights;
  for (std::size_t k = 0; k < sd_mm.size(); ++k) {
    weights.push_back(1 / (sd_mm[k] * sd_mm[k]));
    view.observations[k].weight = weights.back();
  }
  SortObservations(view.grid, view.observations);
  AddRows(PointTerm{.weight = SortedSum(std::move(weights))}, view, sink);
}

void AddPrior(const LevelView& view, std::span<const Term> terms, double scale, RowSink& sink) {
  for (const Term& term : terms) {
    std::visit(
        [&]<class T>(T t) {
          t.weight = scale * t.weight;
          if constexpr (RowTerm<T> && !std::is_same_v<T, PointTerm> &&
                        !std::is_same_v<T, LandmarkTerm>) {
            AddRows(t, view, sink);
          }
        },
        term);
  }
}

// The rows whose sum of squares is minus twice the logarithm of the posterior's density.
void AddModel(const LevelView& view, std::span<const double> sd_mm, std::span<const Term> terms,
              RowSink& sink) {
  if (!view.observations.empty() && PointWeight(terms) > 0) {
    AddPoints(view, sd_mm, sink);
  }
  AddPrior(view, terms, PriorScale(view, sd_mm, terms), sink);
}

void RequireFactor(const SubspaceSolver& factor) {
  if (!factor.usable()) {
    throw InputError("posterior: the normal matrix has no factor; add a prior or smoothness term");
  }
}

SparseMatrix NormalOf(const LevelView& view, std::span<const double> sd_mm,
                      std::span<const Term> terms) {
  NormalMatrix normal(view.grid);
  AddModel(view, sd_mm, terms, normal);
  return normal.Lower();
}

std::vector<double> SigmaWithin(const LevelView& view, std::span<const double> sd_mm,
                                std::span<const Term> given, std::span<const Vec2> uv,
                                SparseMatrix space) {
  Check(view, sd_mm, given);
  double chosen = kNaN;
  const SparseMatrix lower = NormalOf(view, sd_mm, WithChosenWeight(view, given, chosen));
  const SubspaceSolver factor(lower, std::move(space));
  RequireFactor(factor);
  constexpr std::size_t kAtOnce = 64;  // right-hand sides, to bound the memory
  std::vector<double> sigma;
  for (std::size_t begin = 0; begin < uv.size(); begin += kAtOnce) {
    const auto part = uv.subspan(begin, std::min(kAtOnce, uv.size() - begin));
    Eigen::MatrixXd stencils = Eigen::MatrixXd::Zero(lower.rows(), part.size());
    for (std::size_t k = 0; k < part.size(); ++k) {
      const Stencil s = view.grid.StencilAt(part[k]);
      for (int v = 0; v < 16; ++v) {
        stencils(s.index[v], k) += s.weight[v];
      }
    }
    const Eigen::VectorXd variances = stencils.cwiseProduct(factor.Solve(stencils)).colwise().sum();
    for (const double variance : variances) {
      sigma.push_back(std::sqrt(std::max(variance, 0.0)));
    }
  }
  return sigma;
}

std::vector<ControlNet> SamplesWithin(const LevelView& view, std::span<const double> sd_mm,
                                      std::span<const Term> given, int count,
                                      std::uint64_t random_seed, SparseMatrix space) {
  Check(view, sd_mm, given);
  double chosen = kNaN;
  const std::vector<Term> terms = WithChosenWeight(view, given, chosen);
  const SubspaceSolver factor(NormalOf(view, sd_mm, terms), std::move(space));
  RequireFactor(factor);
  Random random(random_seed);
  std::vector<ControlNet> samples;
  for (int sample = 0; sample < count; ++sample) {
    NoiseSink noise(static_cast<Eigen::Index>(view.start.vertices.size()), random);
    AddModel(view, sd_mm, terms, noise);
    const Eigen::MatrixXd step = factor.Solve(noise.Sum());
    samples.push_back(view.start);
    for (std::size_t k = 0; k < view.start.vertices.size(); ++k) {
      samples.back().vertices[k] += step.row(static_cast<Eigen::Index>(k)).transpose();
    }
  }
  return samples;
}

}  // namespace

std::vector<double> PosteriorSigma(const LevelView& view, std::span<const double> sd_mm,
                                   std::span<const Term> terms, std::span<const Vec2> uv) {
  return SigmaWithin(view, sd_mm, terms, uv, {});
}

std::vector<double> PosteriorSigma(const HSplineSurface& surface, const HSplineSurface& rest,
                                   const FitTarget& target, std::span<const double> sd_mm,
                                   int level, std::span<const Term> terms,
                                   std::span<const Vec2> uv) {
  return SigmaWithin(ViewOfLevel(surface, rest, target, level), sd_mm, terms, uv,
                     SubspaceBasis(surface, level));
}

std::vector<ControlNet> PosteriorSamples(const LevelView& view, std::span<const double> sd_mm,
                                         std::span<const Term> terms, int count,
                                         std::uint64_t random_seed) {
  return SamplesWithin(view, sd_mm, terms, count, random_seed, {});
}

std::vector<HSplineSurface> PosteriorSamples(const HSplineSurface& surface,
                                             const HSplineSurface& rest, const FitTarget& target,
                                             std::span<const double> sd_mm, int level,
                                             std::span<const Term> terms, int count,
                                             std::uint64_t random_seed) {
  std::vector<HSplineSurface> samples;
  const LevelView view = ViewOfLevel(surface, rest, target, level);
  for (const ControlNet& net :
       SamplesWithin(view, sd_mm, terms, count, random_seed, SubspaceBasis(surface, level))) {
    samples.push_back(surface);
    samples.back().SetNet(level, net);
  }
  return samples;
}

}  // namespace semblance
