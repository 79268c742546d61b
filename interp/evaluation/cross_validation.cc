// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/evaluation/cross_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "interp/dowels/site_code.h"
#include "interp/evaluation/calibration.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/random.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance {
namespace {

constexpr double kSigmas90 = 1.6448536269514722;  // of a normal distribution, both sides

// The dowels that are shown, and the network between them.
struct Shown {
  std::vector<Dowel> dowels;
  DowelNetwork network;
};

Shown Without(const DepthInput& input, const std::vector<std::size_t>& fold) {
  Shown shown;
  std::vector<int> index(input.dowels.size(), -1);
  for (std::size_t i = 0; i < input.dowels.size(); ++i) {
    if (std::ranges::find(fold, i) == fold.end()) {
      index[i] = static_cast<int>(shown.dowels.size());
      shown.dowels.push_back(input.dowels[i]);
    }
  }
  for (const auto& [a, b, c] : input.network.areas) {
    if (index[a] >= 0 && index[b] >= 0 && index[c] >= 0) {
      shown.network.areas.push_back({index[a], index[b], index[c]});
    }
  }
  return shown;
}

// What the scheme gives, before the rule. A scheme on the network of which the fold leaves no area
// knows no depth anywhere.
DepthField Interpolated(const DepthScheme& scheme, const DepthInput& input, const RunContext& run) {
  return NeedsNetwork(scheme) && input.network.areas.empty()
             ? EmptyDepthField(input.skull.points.size())
             : InterpolateDepth(scheme, input, run);
}

// At one vertex a left-out dowel, for schemes in space.
DepthField FieldAtBases(const DepthScheme& scheme, const OutsideRule& rule, const Shown& shown,
                        const DepthInput& all, const std::vector<std::size_t>& fold,
                        const RunContext& run) {
  TriMesh points;
  std::vector<Vec3> normals;
  for (const std::size_t i : fold) {
    points.points.push_back(all.dowels[i].base);
    normals.push_back(all.dowels[i].direction);
  }
  const DepthInput input{points, normals, shown.dowels, shown.network, all.expected};
  return ApplyOutsideRule(rule, input, Interpolated(scheme, input, run), run);
}

// Of each dowel the skull's vertex at which a field on the skull is asked for its depth.
std::vector<std::size_t> NearestCorners(const DepthInput& input) {
  if (input.skull.triangles.empty()) {
    return {};  // which the scheme will say, by its name
  }
  const MeshQuery query(input.skull);
  std::vector<std::size_t> corners;
  for (const Dowel& dowel : input.dowels) {
    const Triangle& t = input.skull.triangles[query.Closest(dowel.base).triangle];
    corners.push_back(*std::ranges::min_element(t, {}, [&](int i) {
      return std::pair((input.skull.points[i] - dowel.base).squaredNorm(), i);
    }));
  }
  return corners;
}

// The same from a field on the whole skull.
DepthField FieldAtCorners(const DepthScheme& scheme, const OutsideRule& rule, const Shown& shown,
                          const DepthInput& all, const std::vector<std::size_t>& fold,
                          const std::vector<std::size_t>& corners, const RunContext& run) {
  const DepthField field = Interpolated(
      scheme, {all.skull, all.normals, shown.dowels, shown.network, all.expected}, run);
  TriMesh points;
  std::vector<Vec3> normals;
  DepthField at = EmptyDepthField(fold.size());
  for (std::size_t k = 0; k < fold.size(); ++k) {
    const std::size_t corner = corners[fold[k]];
    points.points.push_back(all.skull.points[corner]);
    normals.push_back(all.normals[corner]);
    at.depth_mm[k] = field.depth_mm[corner];
    at.sd_mm[k] = field.sd_mm[corner];
    at.status[k] = field.status[corner];
  }
  return ApplyOutsideRule(rule, {points, normals, shown.dowels, shown.network}, at, run);
}

LeftOut Compared(const Dowel& dowel, const DepthField& field, std::size_t k) {
  LeftOut out{.site = dowel.site,
              .depth_mm = dowel.depth_mm,
              .predicted_mm = field.depth_mm[k],
              .error_mm = field.depth_mm[k] - dowel.depth_mm,
              .sd_mm = field.sd_mm[k],
              .status = field.status[k],
              .within_90 = std::nullopt};
  if (std::isfinite(out.error_mm) && std::isfinite(out.sd_mm)) {
    out.within_90 = std::abs(out.error_mm) <= kSigmas90 * out.sd_mm;
  }
  return out;
}

std::vector<LeftOut> LeaveOut(const DepthScheme& scheme, const OutsideRule& rule,
                              const DepthInput& input, const std::vector<std::size_t>& fold,
                              const std::vector<std::size_t>& corners, const RunContext& run) {
  const Shown shown = Without(input, fold);
  const DepthField field = NeedsSurface(scheme)
                               ? FieldAtCorners(scheme, rule, shown, input, fold, corners, run)
                               : FieldAtBases(scheme, rule, shown, input, fold, run);
  std::vector<LeftOut> left_out;
  for (std::size_t k = 0; k < fold.size(); ++k) {
    left_out.push_back(Compared(input.dowels[fold[k]], field, k));
  }
  return left_out;
}

void Summarise(CrossValidation& result) {
  double sum = 0, absolute = 0, squares = 0, most = 0;
  std::vector<double> errors_mm, sds_mm;
  for (const LeftOut& out : result.left_out) {
    errors_mm.push_back(out.error_mm);
    sds_mm.push_back(out.sd_mm);
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
}

void CheckFolds(const Folds& folds, std::size_t dowels) {
  for (std::size_t f = 0; f < folds.size(); ++f) {
    for (const std::size_t i : folds[f]) {
      if (i >= dowels) {
        throw InputError(fmt::format(
            "cross-validation: fold {} names dowel {}, but there are {} (0..{}); make the folds "
            "from these dowels",
            f, i, dowels, dowels - 1));
      }
    }
    std::vector<std::size_t> distinct = folds[f];
    std::ranges::sort(distinct);
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    if (distinct.size() >= dowels) {
      throw InputError(
          fmt::format("cross-validation: fold {} leaves out all of the {} dowels; at least one "
                      "must be left to predict from",
                      f, dowels));
    }
  }
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
        "cross-validation: {} folds; at least 2 are needed, as each is left out in turn", count));
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
  CheckDepthInput(input);
  CheckFolds(folds, input.dowels.size());
  RunContext of_fold;  // silent: events must not come from several threads
  of_fold.stop_token = run.stop_token;
  const std::vector<std::size_t> corners =
      NeedsSurface(scheme) ? NearestCorners(input) : std::vector<std::size_t>{};
  std::vector<std::vector<LeftOut>> left_out(folds.size());
  ParallelFor(folds.size(), run.threads, 1, [&](std::size_t f) {
    run.ThrowIfStopped();
    left_out[f] = LeaveOut(scheme, rule, input, folds[f], corners, of_fold);
  });
  CrossValidation result;
  for (const std::vector<LeftOut>& of : left_out) {
    result.left_out.insert(result.left_out.end(), of.begin(), of.end());
  }
  Summarise(result);
  return result;
}

}  // namespace semblance
