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
#include "interp/stacking/stacking_weights.h"
#include "surfaces/base/farthest_first.h"

namespace semblance::interp {
namespace {

constexpr std::size_t kMaxTestDowels = 64;  // left-out dowels; the cost grows with the fourth power
constexpr std::size_t kMaxSolves = 8;       // of a scheme on the surface without InterpolateLeftOut

std::string_view SchemeName(const SingleScheme& scheme) {
  return std::visit([](const auto& o) { return o.kName; }, scheme);
}

// The ascending indices of dowels that lie far apart, beginning with the first by site.
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

// The dowels that are left out in turn, with the areas between them.
ShownDowels ChooseTestDowels(const DepthInput& input) {
  const std::vector<std::size_t> kept = FarApart(input.dowels, kMaxTestDowels);
  ShownDowels tested;
  std::map<int, int> index;
  for (const std::size_t i : kept) {
    index[static_cast<int>(i)] = static_cast<int>(tested.dowels.size());
    tested.dowels.push_back(input.dowels[i]);
  }
  for (const auto& [a, b, c] : input.network.areas) {
    if (index.contains(a) && index.contains(b) && index.contains(c)) {
      tested.network.areas.push_back({index[a], index[b], index[c]});
    }
  }
  return tested;
}

// Puts dowel number i by site into fold i modulo count.
Folds MakeFolds(std::span<const Dowel> dowels, std::size_t count) {
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

// Uses few folds for a scheme that needs one solve on the surface per fold.
Folds FoldsFor(const Interpolator& scheme, std::span<const Dowel> dowels) {
  const bool is_expensive = scheme.needs_surface && !scheme.left_out;
  return MakeFolds(dowels, is_expensive ? kMaxSolves : dowels.size());
}

// Returns true if each fold leaves enough dowels and areas for the scheme.
bool CanBeTested(const SingleScheme& scheme, const DepthInput& input) {
  if (SingleNeedsNetwork(scheme) && input.network.areas.empty()) {
    return false;
  }
  const std::size_t fewest = SingleFewestDowels(scheme);
  return fewest == 1 ||  // CheckFolds ensures one
         std::ranges::all_of(
             FoldsFor(MakeInterpolator(scheme), input.dowels), [&](const auto& fold) {
               return DepthSamples(LeaveOutDowels(input.dowels, input.network, fold).dowels)
                          .size() >= fewest;
             });
}

// The errors of a scheme at each left-out dowel, in the order of the dowels.
Eigen::VectorXd LeftOutErrors(const SingleScheme& scheme, const DepthInput& tested,
                              const RunContext& run) {
  const Interpolator interpolator = MakeInterpolator(scheme);
  const Folds folds = FoldsFor(interpolator, tested.dowels);
  const std::vector<DepthField> fields =
      LeaveOut(interpolator, ExtendNetwork{}, tested, folds, run);
  Eigen::VectorXd errors(std::ssize(tested.dowels));
  for (std::size_t f = 0; f < folds.size(); ++f) {
    for (std::size_t k = 0; k < folds[f].size(); ++k) {
      const std::size_t i = folds[f][k];
      errors[static_cast<Eigen::Index>(i)] = fields[f].depth_mm[k] - tested.dowels[i].depth_mm;
    }
  }
  return errors;
}

// The weight of each dowel by its distance to the nearest other one.
Eigen::VectorXd ImportanceAt(const std::vector<double>& distances_mm) {
  constexpr double kNearest = 0.3;  // of the mean distance; limits the weight of close pairs
  const Eigen::Map<const Eigen::VectorXd> distance(distances_mm.data(), std::ssize(distances_mm));
  const double mean = distance.mean();
  if (!(mean > 0)) {
    return Eigen::VectorXd::Ones(distance.size());
  }
  return (distance.array() / mean).max(kNearest).square().inverse();
}

// The schemes, their weights, and the uncertainty of their mean.
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
                [&](const SingleScheme& scheme) { return !CanBeTested(scheme, input); });
  if (mixture.schemes.empty()) {
    mixture.schemes = {options.schemes.front()};  // its error states what is missing
  }
  if (mixture.schemes.size() == 1 || input.dowels.size() < 2) {
    mixture.schemes.resize(1);
    mixture.weights = Eigen::VectorXd::Ones(1);
    return mixture;
  }
  const ShownDowels shown = ChooseTestDowels(input);
  const DepthInput tested{input.skull,   input.normals,  shown.dowels,
                          shown.network, input.expected, input.bone};
  Eigen::MatrixXd errors(std::ssize(shown.dowels), std::ssize(mixture.schemes));
  for (Eigen::Index k = 0; k < errors.cols(); ++k) {
    errors.col(k) = LeftOutErrors(mixture.schemes[k], tested, run);
  }
  std::vector<double> distances;
  for (std::size_t i = 0; i < shown.dowels.size(); ++i) {
    distances.push_back(
        LeaveOutDowels(shown.dowels, shown.network, {i}).NearestTo_mm(shown.dowels[i].base));
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

// Describes a scheme's options in a few words each: `matern_5_2`, `power 4`, `no clamp`.
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

// The scheme's name and the options that differ from their defaults.
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

// Name and weight of each scheme. A name that occurs twice gets the options, and if these are equal
// too, a number.
std::vector<SchemeShare> MakeShares(const Mixture& mixture) {
  std::map<std::string, int> uses;
  std::vector<SchemeShare> shares;
  for (std::size_t k = 0; k < mixture.schemes.size(); ++k) {
    const std::string_view plain = SchemeName(mixture.schemes[k]);
    const bool is_alone = std::ranges::count(mixture.schemes, plain, SchemeName) == 1;
    const std::string name = is_alone ? std::string(plain) : NameWithOptions(mixture.schemes[k]);
    const int use = ++uses[name];
    shares.push_back({use == 1 ? name : fmt::format("{} {}", name, use),
                      mixture.weights[static_cast<Eigen::Index>(k)]});
  }
  return shares;
}

// The weighted mean of the fields (at least one), each continued where another one has a depth.
DepthField Mixed(std::vector<DepthField> fields, const std::vector<double>& weights,
                 const DepthInput& input, const RunContext& run) {
  const auto most = std::ranges::max_element(weights) - weights.begin();
  RunContext silent = run;
  silent.on_event = nullptr;  // the user's outside rule may differ
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
      fields.push_back(MakeInterpolator(mixture.schemes[k]).interpolate(input, run));
      weights.push_back(weight);
    }
  }
  DepthField field = mixture.schemes.size() == 1 ? std::move(fields[0])
                                                 : Mixed(std::move(fields), weights, input, run);
  if (mixture.schemes.size() > 1) {
    StateSd(mixture.sd, input, run, field);
  }
  field.shares = MakeShares(mixture);
  return field;
}

}  // namespace semblance::interp
