// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/stacking/leave_out.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "interp/dowels/dowel_samples.h"
#include "surfaces/base/error.h"
#include "surfaces/base/parallel.h"
#include "surfaces/base/quantile.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::interp {
namespace {

using Fold = std::vector<std::size_t>;

// The fold's dowels as points of bone that faces along their directions.
struct Bases {
  TriMesh points;
  std::vector<Vec3> normals;
  std::span<const Dowel> expected;

  Bases(const DepthInput& input, const Fold& fold) : expected(input.expected) {
    for (const std::size_t i : fold) {
      points.points.push_back(input.dowels[i].base);
      normals.push_back(input.dowels[i].direction);
    }
  }
  DepthInput Given(const ShownDowels& shown) const {
    return {points, normals, shown.dowels, shown.network, expected};
  }
};

// The scheme's prediction before the outside rule. It is empty if the fold leaves no area to a
// scheme on the network, or too few dowels.
DepthField Interpolated(const Interpolator& scheme, const DepthInput& input,
                        const RunContext& run) {
  const bool cannot = (scheme.needs_network && input.network.areas.empty()) ||
                      DepthSamples(input.dowels).size() < scheme.fewest_dowels;
  return cannot ? EmptyDepthField(input.skull.points.size()) : scheme.interpolate(input, run);
}

// The vertex at which a field on the skull predicts each dowel.
std::vector<std::size_t> NearestCorners(const DepthInput& input) {
  if (input.skull.triangles.empty()) {
    return {};  // the scheme will throw, with its name
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

// The fold's entries of a field on the whole skull.
DepthField AtCorners(const Interpolator& scheme, const DepthInput& all, const ShownDowels& shown,
                     const Fold& fold, const std::vector<std::size_t>& corners,
                     const RunContext& run) {
  const DepthField field = Interpolated(
      scheme, {all.skull, all.normals, shown.dowels, shown.network, all.expected, all.bone}, run);
  DepthField at = EmptyDepthField(fold.size());
  for (std::size_t k = 0; k < fold.size(); ++k) {
    const std::size_t corner = corners[fold[k]];
    at.depth_mm[k] = field.depth_mm[corner];
    at.sd_mm[k] = field.sd_mm[corner];
    at.status[k] = field.status[corner];
  }
  return at;
}

std::vector<DepthField> OneByOne(const Interpolator& scheme, const DepthInput& input,
                                 const Folds& folds, const RunContext& run) {
  RunContext of_fold;  // silent, because events must not come from several threads
  of_fold.stop_token = run.stop_token;
  const std::vector<std::size_t> corners =
      scheme.needs_surface ? NearestCorners(input) : std::vector<std::size_t>{};
  std::vector<DepthField> fields(folds.size());
  ParallelFor(folds.size(), run.threads, 1, [&](std::size_t f) {
    run.ThrowIfStopped();
    const ShownDowels shown = LeaveOutDowels(input.dowels, input.network, folds[f]);
    fields[f] = scheme.needs_surface
                    ? AtCorners(scheme, input, shown, folds[f], corners, of_fold)
                    : Interpolated(scheme, Bases(input, folds[f]).Given(shown), of_fold);
  });
  return fields;
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

constexpr std::size_t kMinErrors = 3;               // errors needed for a fit
constexpr double kNearest = 0.1, kFurthest = 2;     // limits, relative to the mean distance
constexpr double kHalfWithin = 0.6744897501960817;  // median of |x| for a standard normal x

}  // namespace

Interpolator MakeInterpolator(const SingleScheme& scheme) {
  Interpolator interpolator{.interpolate = {},
                            .left_out = {},
                            .needs_surface = SingleNeedsSurface(scheme),
                            .needs_network = SingleNeedsNetwork(scheme),
                            .fewest_dowels = SingleFewestDowels(scheme)};
  std::visit(
      [&](const auto& options) {
        interpolator.interpolate = [options](const DepthInput& input, const RunContext& run) {
          return InterpolateDepth(options, input, run);
        };
        if constexpr (requires(const DepthInput& input, const Folds& folds, const RunContext& run) {
                        InterpolateLeftOut(options, input, folds, run);
                      }) {
          interpolator.left_out = [options](const DepthInput& input, const Folds& folds,
                                            const RunContext& run) {
            return InterpolateLeftOut(options, input, folds, run);
          };
        }
      },
      scheme);
  return interpolator;
}

std::vector<DepthField> LeaveOut(const Interpolator& scheme, const OutsideRule& rule,
                                 const DepthInput& input, const Folds& folds,
                                 const RunContext& run) {
  CheckDepthInput(input);
  CheckFolds(folds, input.dowels.size());
  std::vector<DepthField> fields =
      scheme.left_out ? scheme.left_out(input, folds, run) : OneByOne(scheme, input, folds, run);
  RunContext silent;
  silent.stop_token = run.stop_token;
  for (std::size_t f = 0; f < folds.size(); ++f) {
    fields[f] = ApplyOutsideRule(
        rule, Bases(input, folds[f]).Given(LeaveOutDowels(input.dowels, input.network, folds[f])),
        std::move(fields[f]), silent);
  }
  return fields;
}

double SdByDistance::At(double to_nearest_mm) const {
  return scale_mm * std::sqrt(std::clamp(to_nearest_mm / distance_mm, kNearest, kFurthest));
}

SdByDistance FitSdByDistance(std::span<const double> errors_mm,
                             std::span<const double> distances_mm) {
  SdByDistance unit{.scale_mm = 1, .distance_mm = 0};
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < errors_mm.size(); ++i) {
    if (std::isfinite(errors_mm[i]) && std::isfinite(distances_mm[i])) {
      known.push_back(i);
      unit.distance_mm += distances_mm[i];
    }
  }
  if (known.size() < kMinErrors || !(unit.distance_mm > 0)) {
    return {};
  }
  unit.distance_mm /= static_cast<double>(known.size());
  std::vector<double> ratios;
  for (const std::size_t i : known) {
    ratios.push_back(std::abs(errors_mm[i]) / unit.At(distances_mm[i]));
  }
  return {Quantile(ratios, 0.5) / kHalfWithin, unit.distance_mm};
}

}  // namespace semblance::interp
