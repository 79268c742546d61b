// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/limit_depths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "problems/subject/sites.h"
#include "surfaces/base/error.h"
#include "surfaces/mesh/mesh_query.h"

namespace semblance::problems {
namespace {

// The ranges at all standard sites, and the site that decides at a point of the bone.
class Ranges {
 public:
  Ranges(std::span<const DepthBound> bounds, const SkullSites& sites) : sites_(sites) {
    for (const std::string& site : StandardSiteCodes()) {
      ranges_[site] = AllowedAt(bounds, site);
    }
  }

  // The nearest standard site.
  const std::string& SiteAt(const Vec3& p) const {
    return std::ranges::min_element(
               sites_.points, {}, [&](const auto& site) { return (site.second - p).squaredNorm(); })
        ->first;
  }
  const DepthRange& At(const std::string& site) const { return ranges_.at(site); }

 private:
  const SkullSites& sites_;
  std::map<std::string, DepthRange> ranges_;
};

const SkullSites& RequireSites(const Case& subject) {
  if (!subject.basis.sites) {
    throw InputError(fmt::format(
        "{}: tissue.bounds needs three landmarks at standard sites or more, to know which bone "
        "belongs to a site; add landmarks, or leave the bounds out",
        subject.name));
  }
  return *subject.basis.sites;
}

// Tells known depths from those of a table.
class KnownSites {
 public:
  KnownSites(const Experiment& experiment, const LandmarkFile& landmarks)
      : experiment_(experiment), given_(KnownDepths(experiment.tissue.given, landmarks)) {}

  bool Contains(const std::string& site) const {
    const auto own = experiment_.sites.find(site);
    return experiment_.tissue.AreMeasured() || given_.contains(site) ||
           !FindSetKey(experiment_.tissue, site).empty() ||
           (own != experiment_.sites.end() && own->second.depth);
  }

 private:
  const Experiment& experiment_;
  std::map<std::string, double> given_;
};

// The bound that moves a depth to this side of its range.
int MovingBound(const DepthRange& range, double depth_mm) {
  return depth_mm < range.least_mm ? range.least_bound : range.most_bound;
}

void Limit(const DepthRange& range, Dowel& dowel, Case& subject) {
  const double limited_mm = range.Limited(dowel.depth_mm);
  if (limited_mm != dowel.depth_mm) {
    subject.bounds[MovingBound(range, dowel.depth_mm)].dowels.push_back(dowel.site);
    subject.notes.push_back(
        fmt::format("site {}: the depth of {:.2f} mm is not within {}; {} mm is used",
                    DescribeSite(dowel.site), dowel.depth_mm, range.Words(), limited_mm));
  }
  dowel.depth_mm = limited_mm;
  dowel.sd_mm = range.LimitedSd(dowel.sd_mm);
}

// The distances of the shell's vertices from the bone, mm; 0 where the skull was not filled.
std::vector<double> Lifts(const Experiment& experiment, const TriMesh& shell, const TriMesh& bone) {
  std::vector<double> lifts(shell.points.size(), 0.0);
  if (!std::holds_alternative<NoFill>(experiment.fill)) {
    const MeshQuery query(bone);
    std::ranges::transform(shell.points, lifts.begin(),
                           [&](const Vec3& p) { return query.Closest(p).distance_mm; });
  }
  return lifts;
}

// The depth over the shell that the range allows for a depth over the bone. The shell keeps at
// least 1 mm, or what it had.
double LimitedOverShell(const DepthRange& range, double depth_mm, double lift_mm) {
  constexpr double kLeastDepth_mm = 1;
  return std::max(range.Limited(depth_mm + lift_mm) - lift_mm, std::min(depth_mm, kLeastDepth_mm));
}

// Sums the areas where a bound holds and where it moved the depth.
class EffectSums {
 public:
  EffectSums(std::span<const DepthBound> bounds, std::vector<BoundEffect>& effects)
      : bounds_(bounds), effects_(effects), moved_cm2_(bounds.size(), 0.0) {
    for (BoundEffect& effect : effects_) {
      effect.bone_cm2 = effect.largest_move_mm = 0;
    }
  }

  void Add(const std::string& site, double area_cm2) {
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      effects_[k].bone_cm2 += HoldsAt(bounds_[k], site) ? area_cm2 : 0;
    }
  }
  void AddMoved(int bound, double area_cm2, double move_mm) {
    moved_cm2_[bound] += area_cm2;
    effects_[bound].largest_move_mm = std::max(effects_[bound].largest_move_mm, move_mm);
  }
  void Finish(std::vector<std::string>& notes) {
    for (std::size_t k = 0; k < bounds_.size(); ++k) {
      BoundEffect& effect = effects_[k];
      effect.moved_share = effect.bone_cm2 > 0 ? moved_cm2_[k] / effect.bone_cm2 : 0;
      if (effect.largest_move_mm > 0) {
        notes.push_back(fmt::format(
            "tissue.bounds[{}] ({}) moved the interpolated depth of {:.1f} % of its bone, by up to "
            "{:.1f} mm",
            k, effect.name, 100 * effect.moved_share, effect.largest_move_mm));
      }
    }
  }

 private:
  std::span<const DepthBound> bounds_;
  std::vector<BoundEffect>& effects_;
  std::vector<double> moved_cm2_;
};

}  // namespace

void LimitDowels(const Experiment& experiment, const LandmarkFile& landmarks, Case& subject) {
  if (experiment.tissue.bounds.empty()) {
    return;
  }
  const Ranges ranges(experiment.tissue.bounds, RequireSites(subject));
  const KnownSites known(experiment, landmarks);
  std::vector<std::string> faults;
  for (Dowel& dowel : subject.dowels_on_bone) {
    const bool standard = IsStandardSite(dowel.site);
    const DepthRange& range = ranges.At(standard ? dowel.site : ranges.SiteAt(dowel.base));
    if (!known.Contains(dowel.site)) {
      Limit(range, dowel, subject);
    } else if (!range.Contains(dowel.depth_mm)) {
      faults.push_back(fmt::format("site {}: {}", DescribeSite(dowel.site),
                                   KnownDepthFault(dowel.depth_mm, range)));
    }
  }
  if (!faults.empty()) {
    throw InputError(fmt::format("{}", fmt::join(faults, "\n")));
  }
}

void LimitDepths(const Experiment& experiment, const TriMesh& shell, Case& subject,
                 DepthField& field) {
  if (experiment.tissue.bounds.empty()) {
    return;
  }
  const Ranges ranges(experiment.tissue.bounds, RequireSites(subject));
  EffectSums sums(experiment.tissue.bounds, subject.bounds);
  const std::vector<double> areas_mm2 = VertexAreas(shell);
  const std::vector<double> lifts = Lifts(experiment, shell, subject.skull);
  for (std::size_t v = 0; v < field.depth_mm.size(); ++v) {
    double& depth_mm = field.depth_mm[v];
    if (!std::isfinite(depth_mm)) {
      continue;
    }
    const std::string& site = ranges.SiteAt(shell.points[v]);
    const DepthRange& range = ranges.At(site);
    sums.Add(site, areas_mm2[v] / 100);
    if (!range.Contains(depth_mm + lifts[v])) {
      const double limited_mm = LimitedOverShell(range, depth_mm, lifts[v]);
      sums.AddMoved(MovingBound(range, depth_mm + lifts[v]), areas_mm2[v] / 100,
                    std::abs(limited_mm - depth_mm));
      depth_mm = limited_mm;
    }
    field.sd_mm[v] = range.LimitedSd(field.sd_mm[v]);
  }
  sums.Finish(subject.notes);
}

}  // namespace semblance::problems
