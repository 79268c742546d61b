// SPDX-License-Identifier: GPL-3.0-or-later
#include "interp/cross_validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "surfaces/error.h"
#include "surfaces/mesh_query.h"
#include "surfaces/parallel.h"

namespace semblance {
namespace {

constexpr double kSigmas90 = 1.6448536269514722;  // of a normal distribution, both sides

std::string LandmarkOf(const std::string& site) {
  return site.ends_with("_l") || site.ends_with("_r") ? site.substr(0, site.size() - 2) : site;
}

// The dowels that are shown, and the network between them.
struct Shown {
  std::vector<Dowel> dowels;
  DowelNetwork network;
};

Shown Without(const DepthInput& input, const std::vector<std::size_t>& fold) {
  Shown shown;
  std::vector<int> place(input.dowels.size(), -1);
  for (std::size_t i = 0; i < input.dowels.size(); ++i) {
    if (std::ranges::find(fold, i) == fold.end()) {
      place[i] = static_cast<int>(shown.dowels.size());
      shown.dowels.push_back(input.dowels[i]);
    }
  }
  for (const auto& [a, b, c] : input.network.areas) {
    if (place[a] >= 0 && place[b] >= 0 && place[c] >= 0) {
      shown.network.areas.push_back({place[a], place[b], place[c]});
    }
  }
  return shown;
}

// At one vertex a left-out dowel, for schemes in space.
DepthField FieldAtBases(const DepthScheme& scheme, const OutsideRule& rule, const Shown& shown,
                        std::span<const Dowel> dowels, const std::vector<std::size_t>& fold,
                        const RunContext& run) {
  TriMesh points;
  std::vector<Vec3> normals;
  for (const std::size_t i : fold) {
    points.points.push_back(dowels[i].base);
    normals.push_back(dowels[i].direction);
  }
  const DepthInput input{points, normals, shown.dowels, shown.network};
  return ApplyOutsideRule(rule, input, InterpolateDepth(scheme, input, run), run);
}

std::size_t NearestCorner(const TriMesh& mesh, const MeshQuery& query, const Vec3& p) {
  const Triangle& t = mesh.triangles[query.Closest(p).triangle];
  return *std::ranges::min_element(
      t, {}, [&](int i) { return std::pair((mesh.points[i] - p).squaredNorm(), i); });
}

// The same from a field on the whole skull.
DepthField FieldAtCorners(const DepthScheme& scheme, const OutsideRule& rule, const Shown& shown,
                          const DepthInput& all, const std::vector<std::size_t>& fold,
                          const RunContext& run) {
  const DepthInput input{all.skull, all.normals, shown.dowels, shown.network};
  const DepthField field = ApplyOutsideRule(rule, input, InterpolateDepth(scheme, input, run), run);
  const MeshQuery query(all.skull);
  DepthField at = EmptyDepthField(fold.size());
  for (std::size_t k = 0; k < fold.size(); ++k) {
    const std::size_t corner = NearestCorner(all.skull, query, all.dowels[fold[k]].base);
    at.depth_mm[k] = field.depth_mm[corner];
    at.sd_mm[k] = field.sd_mm[corner];
    at.status[k] = field.status[corner];
  }
  return at;
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
                              const RunContext& run) {
  const Shown shown = Without(input, fold);
  const DepthField field = NeedsSurface(scheme)
                               ? FieldAtCorners(scheme, rule, shown, input, fold, run)
                               : FieldAtBases(scheme, rule, shown, input.dowels, fold, run);
  std::vector<LeftOut> left_out;
  for (std::size_t k = 0; k < fold.size(); ++k) {
    left_out.push_back(Compared(input.dowels[fold[k]], field, k));
  }
  return left_out;
}

void Summarise(CrossValidation& result) {
  double sum = 0, absolute = 0, squares = 0, most = 0;
  int stated = 0, within = 0;
  for (const LeftOut& out : result.left_out) {
    stated += out.within_90.has_value() ? 1 : 0;
    within += out.within_90.value_or(false) ? 1 : 0;
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
  if (stated > 0) {
    result.coverage_90 = static_cast<double>(within) / stated;
  }
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

Folds EachDowel(std::span<const Dowel> dowels) {
  Folds folds;
  for (std::size_t i = 0; i < dowels.size(); ++i) {
    folds.push_back({i});
  }
  return folds;
}

Folds EachLandmark(std::span<const Dowel> dowels) {
  Folds folds;
  std::map<std::string, std::size_t> fold_of;
  for (std::size_t i = 0; i < dowels.size(); ++i) {
    const auto [it, is_new] = fold_of.emplace(LandmarkOf(dowels[i].site), folds.size());
    if (is_new) {
      folds.emplace_back();
    }
    folds[it->second].push_back(i);
  }
  return folds;
}

CrossValidation CrossValidate(const DepthScheme& scheme, const OutsideRule& rule,
                              const DepthInput& input, const Folds& folds, const RunContext& run) {
  CheckDepthInput(input);
  CheckFolds(folds, input.dowels.size());
  RunContext of_fold;  // silent: events must not come from several threads
  of_fold.stop_token = run.stop_token;
  std::vector<std::vector<LeftOut>> left_out(folds.size());
  ParallelFor(folds.size(), run.threads, 1, [&](std::size_t f) {
    run.ThrowIfStopped();
    left_out[f] = LeaveOut(scheme, rule, input, folds[f], of_fold);
  });
  CrossValidation result;
  for (const std::vector<LeftOut>& of : left_out) {
    result.left_out.insert(result.left_out.end(), of.begin(), of.end());
  }
  Summarise(result);
  return result;
}

}  // namespace semblance
