// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/pipeline/extra_dowels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "interp/dowels/network_insertion.h"
#include "problems/conditional/condition_depths.h"
#include "problems/config/spelling_suggestion.h"
#include "problems/face_template/template_source.h"
#include "problems/pipeline/dowel_target.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance {
namespace {

const Landmark* FindLandmark(const LandmarkFile& file, const std::string& site) {
  const auto found = std::ranges::find(file.landmarks, site, &Landmark::site);
  return found == file.landmarks.end() ? nullptr : &*found;
}

bool IsKnown(const std::string& site) { return IsStandardSite(site) || IsFurtherSite(site); }

// Where sites stand before they are laid onto bone.
class Placing {
 public:
  Placing(const Experiment& experiment, const SubjectData& data, const MeshQuery& skull,
          const Case& subject)
      : experiment_(experiment), skull_(skull), dowels_(subject.dowels_on_bone) {
    for (const Landmark& landmark : data.landmarks.landmarks) {
      given_.push_back({landmark.site, Vec3(landmark.point.data())});
    }
  }

  Vec3 At(const std::string& name, const ExtraSite& site) {
    if (site.uv) {
      return UnderFace(name, Vec2((*site.uv)[0], (*site.uv)[1]));
    }
    const Vec3 point = PointNear(name, site.near, given_);
    return ReadPlace(site.near).point ? point : skull_.Closest(point).position;
  }

 private:
  // Of the generic face, brought to the dowels that there are.
  const HSplineSurface& Face() {
    if (!face_) {
      const TemplateFace generic = LoadTemplate(experiment_.face_template);
      const FitTarget known = KnownDowels(dowels_, generic, experiment_.sites);
      face_ = Transformed(generic.surface, PlaceOnDowels(generic, known, experiment_.placement));
    }
    return *face_;
  }

  Vec3 UnderFace(const std::string& name, const Vec2& uv) {
    constexpr double kOver_mm = 30, kFar_mm = 120;
    const SurfaceFrame at = Face().Frame(uv);
    const Vec3 out = at.Normal();
    const auto hit =
        out.allFinite() ? skull_.FirstHit(at.point + kOver_mm * out, -out, kFar_mm) : std::nullopt;
    if (!hit) {
      throw InputError(fmt::format(
          "sites.{}.uv: there is no bone under ({}, {}) of the generic face; give the site another "
          "(u,v), or `near`",
          name, uv.x(), uv.y()));
    }
    return hit->position;
  }

  const Experiment& experiment_;
  const MeshQuery& skull_;
  const std::vector<Dowel>& dowels_;
  std::vector<SitePoint> given_;
  std::optional<HSplineSurface> face_;
};

Dowel OnBone(const std::string& name, const Vec3& point, const SubjectData& data,
             const MeshQuery& skull, const PlaceOptions& options) {
  LandmarkFile alone{.subject = data.landmarks.subject, .landmarks = {}, .absent = {}};
  Landmark& landmark = alone.landmarks.emplace_back();
  landmark.site = name;
  landmark.point = {point.x(), point.y(), point.z()};
  Dowel dowel = PlaceDowels(alone, data.skull, skull, options).front();
  dowel.role = IsKnown(name) ? PointRole::kLandmark : PointRole::kInserted;
  return dowel;
}

void CheckApart(const Dowel& dowel, std::span<const Dowel> others) {
  constexpr double kSame_mm = 0.5;
  for (const Dowel& other : others) {
    if ((dowel.base - other.base).norm() <= kSame_mm) {
      throw InputError(fmt::format(
          "sites.{}: it stands where {} stands, so one point of the bone has two depths; place it "
          "elsewhere, or set the depth of {} alone",
          dowel.site, SiteInWords(other.site), other.site));
    }
  }
}

// The depth of the first table that has the site, with the table's name.
std::optional<std::pair<TissueDepth, std::string>> DepthInTables(const TissueOptions& tissue,
                                                                 const std::string& site) {
  for (const std::filesystem::path& path : TablesOf(tissue)) {
    const TissueTable table = ReadTissueTable(path);
    if (const auto depth = FindDepth(table, tissue.sex, tissue.build, site)) {
      return std::pair(*depth, table.id);
    }
  }
  return std::nullopt;
}

[[noreturn]] void RefuseWithoutDepth(const std::string& name) {
  const std::string near = IsKnown(name) ? "" : NearestWord(name, StandardSiteCodes());
  throw InputError(fmt::format(
      "sites.{}: no depth is given, and no table in use has one; write `depth:` in mm, or `auto` "
      "for the interpolated one{}",
      name, near.empty() ? "" : fmt::format(" (or is '{}' meant?)", near)));
}

// Sets the depth where it is known, and tells where it comes from.
std::string GiveDepth(const ExtraSite& site, const TissueOptions& tissue,
                      const LandmarkFile& landmarks, Dowel& dowel) {
  if (site.depth) {
    dowel.depth_mm = site.depth->automatic ? kNaN : site.depth->value;
    return site.depth->automatic ? "as deep as interpolated there; it changes no other depth"
                                 : fmt::format("{} mm, set by hand", site.depth->value);
  }
  const auto depth = DepthInTables(tissue, dowel.site);
  if (!depth) {
    RefuseWithoutDepth(dowel.site);
  }
  dowel.depth_mm = depth->first.mean_mm;
  dowel.sd_mm = depth->first.sd_mm.value_or(kNaN);
  ConditionDepths(tissue, landmarks, std::span(&dowel, 1));  // its notes are the landmarks' own
  return fmt::format("{:.4g} mm, from table '{}'", dowel.depth_mm, depth->second);
}

// Whether a site of the landmarks is only given a (u,v) or a depth. Throws if it is placed anew.
bool IsLandmark(const std::string& name, const ExtraSite& site, const LandmarkFile& file) {
  if (FindLandmark(file, name) == nullptr) {
    return false;
  }
  if (!site.near.IsNull()) {
    throw InputError(fmt::format(
        "sites.{}: {} appears twice, as it is among the landmarks; leave `near` out, or "
        "give the site a name of its own",
        name, SiteInWords(name)));
  }
  return true;
}

bool IsNamed(const NetworkPlan& plan, const std::string& site) {
  return std::ranges::any_of(plan.areas, [&site](const auto& area) {
    return std::ranges::find(area, site) != area.end();
  });
}

// Of those of the triangle's corners that have one; NaN if none has.
double DepthAt(const MeshPoint& at, const Triangle& corners, const DepthField& depth) {
  double sum = 0, weights = 0;
  for (int k = 0; k < 3; ++k) {
    const double mm = depth.depth_mm[corners[k]];
    if (std::isfinite(mm)) {
      sum += at.weights[k] * mm;
      weights += at.weights[k];
    }
  }
  return weights > 0 ? sum / weights : kNaN;
}

}  // namespace

TissueOptions WithSiteDepths(const Experiment& experiment, const LandmarkFile& landmarks) {
  TissueOptions tissue = experiment.tissue;
  for (const auto& [name, site] : experiment.sites) {
    if (!site.depth || !IsLandmark(name, site, landmarks)) {
      continue;
    }
    if (site.depth->automatic) {
      throw InputError(fmt::format(
          "sites.{}.depth: auto is for a site that is not among the landmarks; give mm", name));
    }
    if (!tissue.set_mm.emplace(name, site.depth->value).second) {
      throw InputError(fmt::format(
          "sites.{}.depth: the depth appears twice, here and in tissue.set_mm; leave one out",
          name));
    }
  }
  return tissue;
}

void InsertDowels(const Experiment& experiment, const SubjectData& data, const MeshQuery& skull,
                  Case& subject) {
  Placing placing(experiment, data, skull, subject);
  std::vector<Dowel> inserted;
  for (const auto& [name, site] : experiment.sites) {
    if (IsLandmark(name, site, data.landmarks)) {
      continue;
    }
    if (!site.uv && site.near.IsNull()) {
      throw InputError(fmt::format(
          "sites.{}: {} is not among the landmarks; place it there, or give `near` or `uv`", name,
          SiteInWords(name)));
    }
    Dowel dowel = OnBone(name, placing.At(name, site), data, skull, experiment.landmarks);
    CheckApart(dowel, subject.dowels_on_bone);
    CheckApart(dowel, inserted);
    subject.notes.push_back(fmt::format("site {}: dowel inserted, {}", SiteInWords(name),
                                        GiveDepth(site, experiment.tissue, data.landmarks, dowel)));
    inserted.push_back(std::move(dowel));
  }
  for (Dowel& dowel : inserted) {
    (std::isnan(dowel.depth_mm) ? subject.open_dowels : subject.dowels_on_bone)
        .push_back(std::move(dowel));
  }
}

std::vector<std::string> JoinNetwork(const NetworkPlan& plan, std::span<const Dowel> dowels,
                                     DowelNetwork& network) {
  std::vector<std::string> notes;
  for (std::size_t k = 0; k < dowels.size(); ++k) {
    const std::string& site = dowels[k].site;
    if (IsStandardSite(site) || IsNamed(plan, site)) {
      continue;
    }
    switch (InsertIntoNetwork(dowels, static_cast<int>(k), network)) {
      case Insertion::kInside:
        break;
      case Insertion::kOutside:
        notes.push_back(fmt::format(
            "site {}: outside the dowel network, which got an area more there", SiteInWords(site)));
        break;
      case Insertion::kNone:
        notes.push_back(
            fmt::format("site {}: outside the dowel network, and no area joins it: schemes that "
                        "work on the network do not use its depth",
                        SiteInWords(site)));
        break;
    }
  }
  return notes;
}

void FillOpenDowels(const TriMesh& shell, const DepthField& depth, Case& subject) {
  if (subject.open_dowels.empty()) {
    return;
  }
  const MeshQuery query(shell);
  for (Dowel& dowel : subject.open_dowels) {
    const MeshPoint at = query.Closest(dowel.base);
    dowel.base = at.position;
    dowel.depth_mm = DepthAt(at, shell.triangles[at.triangle], depth);
    if (std::isfinite(dowel.depth_mm)) {
      subject.dowels_on_bone.push_back(dowel);
    } else {
      subject.notes.push_back(fmt::format("site {}: no depth is interpolated there; dowel left out",
                                          SiteInWords(dowel.site)));
    }
  }
  subject.open_dowels.clear();
}

}  // namespace semblance
