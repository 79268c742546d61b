// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/auto_scheme.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <type_traits>

#include "interp/dowels/dowel_samples.h"
#include "interp/schemes/outside_rule.h"
#include "interp/stacking/leave_out.h"
#include "interp/stacking/sd_by_distance.h"
#include "interp/stacking/stacking_weights.h"
#include "surfaces/base/farthest_first.h"

namespace semblance {
namespace {

constexpr std::size_t kMostJudges = 64;  // dowels left out; the cost grows by its fourth power
constexpr std::size_t kMostSolves = 8;   // of a scheme that has no cheaper way

std::string_view NameOf(const SingleScheme& scheme) {
  return std::visit([](const auto& o) { return o.kName; }, scheme);
}

// Of dowels that lie far apart, beginning with the first by site; rising.
std::vector<std::size_t> FarApart(std::span<const Dowel> dowels, std::size_t count) {
  std::vector<Vec3> bases;
  for (const Dowel& dowel : dowels) {
    bases.push_back(dowel.base);
  }
  const auto first = std::ranges::min_element(dowels, {}, &Dowel::site) - dowels.begin();
  std::vector<std::size_t> chosen = FarthestFirst(bases, static_cast<std::size_t>(first), count);
  std::ranges::sort(chosen);
  return chosen;
}

// The dowels that judge, with the areas between them.
ShownDowels Judges(const DepthInput& input) {
  const std::vector<std::size_t> kept = FarApart(input.dowels, kMostJudges);
  ShownDowels judges;
  std::map<int, int> index;
  for (const std::size_t i : kept) {
    index[static_cast<int>(i)] = static_cast<int>(judges.dowels.size());
    judges.dowels.push_back(input.dowels[i]);
  }
  for (const auto& [a, b, c] : input.network.areas) {
    if (index.contains(a) && index.contains(b) && index.contains(c)) {
      judges.network.areas.push_back({index[a], index[b], index[c]});
    }
  }
  return judges;
}

// Dowel i, of all by site, is in fold i modulo count.
Folds EveryNth(std::span<const Dowel> dowels, std::size_t count) {
  std::vector<std::size_t> order(dowels.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = i;
  }
  std::ranges::sort(order, {}, [&](std::size_t i) { return dowels[i].site; });
  Folds folds(std::min(count, order.size()));
  for (std::size_t k = 0; k < order.size(); ++k) {
    folds[k % folds.size()].push_back(order[k]);
  }
  return folds;
}

// A scheme without a cheaper way to leave out is solved only so often.
Folds FoldsFor(const Interpolator& scheme, std::span<const Dowel> dowels) {
  const bool is_dear = scheme.needs_surface && !scheme.left_out;
  return EveryNth(dowels, is_dear ? kMostSolves : dowels.size());
}

// Does each fold leave the scheme what it works on?
bool CanBeJudged(const SingleScheme& scheme, const DepthInput& input) {
  if (SingleNeedsNetwork(scheme) && input.network.areas.empty()) {
    return false;
  }
  const std::size_t fewest = SingleFewestDowels(scheme);
  return fewest == 1 ||  // which CheckFolds asks for
         std::ranges::all_of(FoldsFor(InterpolatorOf(scheme), input.dowels), [&](const auto& fold) {
           return DepthSamples(Without(input, fold).dowels).size() >= fewest;
         });
}

// What a scheme errs at each judge that it is not shown, in their order.
Eigen::VectorXd ErrorsOf(const SingleScheme& scheme, const DepthInput& judges,
                         const RunContext& run) {
  const Interpolator interpolator = InterpolatorOf(scheme);
  const Folds folds = FoldsFor(interpolator, judges.dowels);
  const std::vector<DepthField> fields =
      LeaveOut(interpolator, ExtendNetwork{}, judges, folds, run);
  Eigen::VectorXd errors(std::ssize(judges.dowels));
  for (std::size_t f = 0; f < folds.size(); ++f) {
    for (std::size_t k = 0; k < folds[f].size(); ++k) {
      const std::size_t i = folds[f][k];
      errors[static_cast<Eigen::Index>(i)] = fields[f].depth_mm[k] - judges.dowels[i].depth_mm;
    }
  }
  return errors;
}

// Of each judge, by its distance to the nearest other one.
Eigen::VectorXd ImportanceAt(const std::vector<double>& distances_mm) {
  constexpr double kNearest = 0.3;  // of the mean: nearer ones count no more
  const Eigen::Map<const Eigen::VectorXd> distance(distances_mm.data(), std::ssize(distances_mm));
  const double mean = distance.mean();
  if (!(mean > 0)) {
    return Eigen::VectorXd::Ones(distance.size());
  }
  return (distance.array() / mean).max(kNearest).square().inverse();
}

// The schemes, what they weigh, and how uncertain their mean is.
struct Mixture {
  std::vector<SingleScheme> schemes;
  Eigen::VectorXd weights;
  SdByDistance sd;
};

Eigen::VectorXd BestAlone(const Eigen::MatrixXd& errors, const Eigen::VectorXd& importance) {
  Eigen::Index best = 0;
  (importance.transpose() * errors.cwiseAbs2()).minCoeff(&best);
  return Eigen::VectorXd::Unit(errors.cols(), best);
}

Mixture Choose(const AutoScheme& options, const DepthInput& input, const RunContext& run) {
  Mixture mixture{options.schemes, {}, {}};
  std::erase_if(mixture.schemes,
                [&](const SingleScheme& scheme) { return !CanBeJudged(scheme, input); });
  if (mixture.schemes.empty()) {
    mixture.schemes = {options.schemes.front()};  // which says what it lacks
  }
  if (mixture.schemes.size() == 1 || input.dowels.size() < 2) {
    mixture.schemes.resize(1);
    mixture.weights = Eigen::VectorXd::Ones(1);
    return mixture;
  }
  const ShownDowels shown = Judges(input);
  const DepthInput judges{input.skull, input.normals, shown.dowels, shown.network, input.expected};
  Eigen::MatrixXd errors(std::ssize(shown.dowels), std::ssize(mixture.schemes));
  for (Eigen::Index k = 0; k < errors.cols(); ++k) {
    errors.col(k) = ErrorsOf(mixture.schemes[k], judges, run);
  }
  std::vector<double> distances;
  for (std::size_t i = 0; i < shown.dowels.size(); ++i) {
    distances.push_back(Without(judges, {i}).NearestTo_mm(shown.dowels[i].base));
  }
  const Eigen::VectorXd importance = ImportanceAt(distances);
  const bool averages = options.takes == AutoTakes::kAverage;
  mixture.weights = averages ? StackingWeights(errors, importance, options.caution)
                             : BestAlone(errors, importance);
  const Eigen::VectorXd mixed = averages ? StackedErrors(errors, importance, options.caution)
                                         : Eigen::VectorXd(errors * mixture.weights);
  mixture.sd = FitSdByDistance({mixed.data(), static_cast<std::size_t>(mixed.size())}, distances);
  return mixture;
}

// What a scheme's options are, a few words each: `matern_5_2`, `power 4`, `no clamp`.
struct OptionsInWords {
  std::vector<std::string> words;

  template <class T>
  void operator()(const FieldInfo& info, const T& value) {
    if constexpr (std::is_enum_v<T>) {
      words.emplace_back(EnumNames(value)[static_cast<std::size_t>(value)]);
    } else if constexpr (std::is_same_v<T, bool>) {
      words.push_back(fmt::format("{}{}", value ? "" : "no ", info.name));
    } else if constexpr (requires { value.has_value(); }) {
      words.push_back(value ? fmt::format("{} {}", info.name, *value)
                            : fmt::format("no {}", info.name));
    } else {
      words.push_back(fmt::format("{} {}", info.name, value));
    }
  }
};

// Name and those options that are not the defaults.
std::string NameWithOptions(const SingleScheme& scheme) {
  return std::visit(
      []<class Scheme>(Scheme options) {
        Scheme defaults;
        OptionsInWords own, usual;
        Fields(own, options);
        Fields(usual, defaults);
        std::string name(Scheme::kName);
        for (std::size_t k = 0; k < own.words.size(); ++k) {
          name += own.words[k] == usual.words[k] ? "" : " " + own.words[k];
        }
        return name;
      },
      scheme);
}

// Name and weight of each scheme, with its options where one stands there twice. A twin in these,
// too, is numbered.
std::vector<SchemeShare> SharesOf(const Mixture& mixture) {
  std::map<std::string, int> uses;
  std::vector<SchemeShare> shares;
  for (std::size_t k = 0; k < mixture.schemes.size(); ++k) {
    const std::string_view plain = NameOf(mixture.schemes[k]);
    const bool is_alone = std::ranges::count(mixture.schemes, plain, NameOf) == 1;
    const std::string name = is_alone ? std::string(plain) : NameWithOptions(mixture.schemes[k]);
    const int use = ++uses[name];
    shares.push_back({use == 1 ? name : fmt::format("{} {}", name, use),
                      mixture.weights[static_cast<Eigen::Index>(k)]});
  }
  return shares;
}

// The mean of the fields, each continued where another one has a depth. At least one.
DepthField Mixed(std::vector<DepthField> fields, const std::vector<double>& weights,
                 const DepthInput& input, const RunContext& run) {
  const auto most = std::ranges::max_element(weights) - weights.begin();
  RunContext silent = run;
  silent.on_event = nullptr;  // the rule may be another one in the end
  DepthField mixed = EmptyDepthField(input.skull.points.size());
  mixed.status = fields[most].status;
  for (DepthField& field : fields) {
    for (std::size_t i = 0; i < field.status.size(); ++i) {
      if (field.status[i] == DepthStatus::kAssigned) {
        mixed.status[i] = DepthStatus::kAssigned;
      }
    }
    field = ApplyOutsideRule(ExtendNetwork{}, input, std::move(field), silent);
  }
  ForEachVertex(input, run, [&](std::size_t i) {
    if (mixed.status[i] == DepthStatus::kAssigned) {
      mixed.depth_mm[i] = 0;
      for (std::size_t k = 0; k < fields.size(); ++k) {
        mixed.depth_mm[i] += weights[k] * fields[k].depth_mm[i];
      }
    }
  });
  return mixed;
}

void StateSd(const SdByDistance& sd, const DepthInput& input, const RunContext& run,
             DepthField& field) {
  ForEachVertex(input, run, [&](std::size_t i) {
    if (field.status[i] == DepthStatus::kAssigned) {
      double nearest2 = std::numeric_limits<double>::infinity();
      for (const Dowel& dowel : input.dowels) {
        nearest2 = std::min(nearest2, (dowel.base - input.skull.points[i]).squaredNorm());
      }
      field.sd_mm[i] = sd.At(std::sqrt(nearest2));
    }
  });
}

}  // namespace

DepthField InterpolateDepth(const AutoScheme& options, const DepthInput& input,
                            const RunContext& run) {
  CheckDepthInput(input);
  run.ThrowIfStopped();
  const Mixture mixture = Choose(options, input, run);
  std::vector<DepthField> fields;
  std::vector<double> weights;
  for (std::size_t k = 0; k < mixture.schemes.size(); ++k) {
    if (const double weight = mixture.weights[static_cast<Eigen::Index>(k)]; weight > 0) {
      fields.push_back(InterpolatorOf(mixture.schemes[k]).interpolate(input, run));
      weights.push_back(weight);
    }
  }
  DepthField field = mixture.schemes.size() == 1 ? std::move(fields[0])
                                                 : Mixed(std::move(fields), weights, input, run);
  if (mixture.schemes.size() > 1) {
    StateSd(mixture.sd, input, run, field);
  }
  field.shares = SharesOf(mixture);
  return field;
}

}  // namespace semblance
