// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/cross_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "interp/dowels/dowel.h"
#include "interp/evaluation/scores.h"
#include "interp/stacking/leave_out.h"
#include "surfaces/base/error.h"
#include "surfaces/base/random.h"

namespace semblance::interp {
namespace {

Interpolator AnyInterpolator(const DepthScheme& scheme) {
  return std::visit(
      [&](const auto& options) -> Interpolator {
        if constexpr (requires { SingleScheme(options); }) {
          return MakeInterpolator(SingleScheme(options));
        } else {
          return {.interpolate =
                      [options](const DepthInput& input, const RunContext& run) {
                        return InterpolateDepth(options, input, run);
                      },
                  .left_out = {},
                  .needs_surface = NeedsSurface(scheme),
                  .needs_network = NeedsNetwork(scheme),
                  .fewest_dowels = FewestDowels(scheme)};
        }
      },
      scheme);
}

LeftOut Compared(const Dowel& dowel, const DepthField& field, std::size_t k) {
  return {.site = dowel.site,
          .depth_mm = dowel.depth_mm,
          .predicted_mm = field.depth_mm[k],
          .error_mm = field.depth_mm[k] - dowel.depth_mm,
          .sd_mm = field.sd_mm[k],
          .nearest_mm = kNaN,
          .status = field.status[k],
          .within_90 = std::nullopt};
}

SdByDistance SdLearned(const std::vector<LeftOut>& left_out) {
  std::vector<double> errors_mm, distances_mm;
  for (const LeftOut& out : left_out) {
    errors_mm.push_back(out.error_mm);
    distances_mm.push_back(out.nearest_mm);
  }
  return FitSdByDistance(errors_mm, distances_mm);
}

// Learns each fold's sd from the other folds.
void StateSds(std::vector<std::vector<LeftOut>>& folds) {
  for (std::size_t f = 0; f < folds.size(); ++f) {
    std::vector<LeftOut> others;
    for (std::size_t g = 0; g < folds.size(); ++g) {
      if (g != f) {
        others.insert(others.end(), folds[g].begin(), folds[g].end());
      }
    }
    const SdByDistance sd = SdLearned(others);
    for (LeftOut& out : folds[f]) {
      out.sd_mm = sd.At(out.nearest_mm);
    }
  }
}

DepthScores ScoreLeftOut(const std::vector<LeftOut>& left_out, bool with_rule) {
  std::vector<double> errors_mm, sds_mm;
  for (const LeftOut& out : left_out) {
    if (with_rule || out.status == DepthStatus::kAssigned) {
      errors_mm.push_back(out.error_mm);
      sds_mm.push_back(out.sd_mm);
    }
  }
  return ScoreDepths(errors_mm, sds_mm);
}

void Summarise(CrossValidation& result) {
  double sum = 0, absolute = 0, squares = 0, most = 0;
  std::vector<double> errors_mm, sds_mm;
  for (LeftOut& out : result.left_out) {
    errors_mm.push_back(out.error_mm);
    sds_mm.push_back(out.sd_mm);
    if (std::isfinite(out.error_mm) && std::isfinite(out.sd_mm)) {
      out.within_90 = ShareAround(out.error_mm, out.sd_mm) <= 0.9;
    }
    if (std::isfinite(out.error_mm)) {
      ++result.predicted;
      sum += out.error_mm;
      absolute += std::abs(out.error_mm);
      squares += out.error_mm * out.error_mm;
      most = std::max(most, std::abs(out.error_mm));
    }
  }
  if (result.predicted > 0) {
    result.rms_mm = std::sqrt(squares / result.predicted);
    result.mean_mm = sum / result.predicted;
    result.mean_absolute_mm = absolute / result.predicted;
    result.most_mm = most;
  }
  result.coverage = Coverage(errors_mm, sds_mm);
  result.coverage_90 = CoverageAt90(result.coverage);
  result.scores = ScoreLeftOut(result.left_out, /*with_rule=*/false);
  result.scores_with_rule = ScoreLeftOut(result.left_out, /*with_rule=*/true);
}

}  // namespace

Folds EachLandmark(std::span<const Dowel> dowels) {
  Folds folds;
  std::map<std::string, std::size_t> fold_of;
  for (std::size_t i = 0; i < dowels.size(); ++i) {
    const auto [it, is_new] = fold_of.emplace(WithoutSide(dowels[i].site), folds.size());
    if (is_new) {
      folds.emplace_back();
    }
    folds[it->second].push_back(i);
  }
  return folds;
}

Folds EachSide(std::span<const Dowel> dowels) {
  Folds folds;
  for (const Side side : {Side::kLeft, Side::kRight}) {
    std::vector<std::size_t> fold;
    for (std::size_t i = 0; i < dowels.size(); ++i) {
      if (SideOfSite(dowels[i].site) == side) {
        fold.push_back(i);
      }
    }
    if (!fold.empty() && fold.size() < dowels.size()) {
      folds.push_back(std::move(fold));
    }
  }
  return folds;
}

Folds RandomFolds(std::span<const Dowel> dowels, int count, std::uint64_t random_seed) {
  if (count < 2) {
    throw InputError(fmt::format(
        "cross-validation: {} folds; at least 2 are needed, because each is left out in turn",
        count));
  }
  std::vector<std::size_t> order(dowels.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return dowels[i].site; });
  Random(random_seed).Shuffle(order);
  Folds folds(std::min<std::size_t>(count, order.size()));
  for (std::size_t k = 0; k < order.size(); ++k) {
    folds[k % folds.size()].push_back(order[k]);
  }
  for (auto& fold : folds) {
    std::ranges::sort(fold);
  }
  return folds;
}

CrossValidation CrossValidate(const DepthScheme& scheme, const OutsideRule& rule,
                              const DepthInput& input, const Folds& folds, const RunContext& run) {
  const std::vector<DepthField> fields = LeaveOut(AnyInterpolator(scheme), rule, input, folds, run);
  std::vector<std::vector<LeftOut>> left_out(folds.size());
  CrossValidation result;
  for (std::size_t f = 0; f < folds.size(); ++f) {
    const ShownDowels shown = LeaveOutDowels(input.dowels, input.network, folds[f]);
    for (std::size_t k = 0; k < folds[f].size(); ++k) {
      const Dowel& dowel = input.dowels[folds[f][k]];
      LeftOut out = Compared(dowel, fields[f], k);
      out.nearest_mm = shown.NearestTo_mm(dowel.base);
      result.own_sd |= out.status == DepthStatus::kAssigned && out.sd_mm > 0;
      left_out[f].push_back(std::move(out));
    }
  }
  if (!result.own_sd) {
    StateSds(left_out);
  }
  for (const std::vector<LeftOut>& of : left_out) {
    result.left_out.insert(result.left_out.end(), of.begin(), of.end());
  }
  result.sd = SdLearned(result.left_out);
  Summarise(result);
  return result;
}

DepthField WithStatedSd(DepthField field, const CrossValidation& known, const DepthInput& input,
                        const RunContext& run) {
  if (known.own_sd) {
    return field;
  }
  const ShownDowels all = LeaveOutDowels(input.dowels, input.network, {});
  ForEachVertex(input, run, [&](std::size_t i) {
    if (std::isfinite(field.depth_mm[i])) {
      field.sd_mm[i] = known.sd.At(all.NearestTo_mm(input.skull.points[i]));
    }
  });
  return field;
}

}  // namespace semblance::interp
