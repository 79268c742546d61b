// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/experiment/extra_dowels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>

#include "interp/dowels/dowel_network.h"
#include "interp/schemes/people.h"
#include "problems/config/spelling_suggestion.h"
#include "problems/experiment/dowel_projection.h"
#include "problems/face/template_source.h"
#include "problems/subject/condition_depths.h"
#include "problems/subject/sites.h"
#include "surfaces/base/error.h"

namespace semblance::problems {
namespace {

const Landmark* FindLandmark(const LandmarkFile& file, const std::string& site) {
  const auto found = std::ranges::find(file.landmarks, site, &Landmark::site);
  return found == file.landmarks.end() ? nullptr : &*found;
}

bool IsKnown(const std::string& site) { return IsStandardSite(site) || IsFurtherSite(site); }

// Finds the points of sites before they are laid onto bone.
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
  // The generic face, brought to the dowels.
  const HSplineSurface& Face() {
    if (!face_) {
      const TemplateFace generic = LoadTemplate(experiment_.face_template);
      const FitTarget known = KnownDowels(dowels_, generic, experiment_.sites);
      face_ = Transformed(generic.surface, PlaceOnDowels(generic, known, experiment_.placement));
    }
    return *face_;
  }

  Vec3 UnderFace(const std::string& name, const Vec2& uv) {
    constexpr double kOver_mm = 30, kFar_mm = 120;  // a ray from outside the face through the head
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

Dowel OnBone(const std::string& name, const Vec3& point, const ExtraSite& site,
             const SubjectData& data, const MeshQuery& skull, const PlaceOptions& options,
             std::map<std::string, double>& turns_deg) {
  LandmarkFile alone{.subject = data.landmarks.subject, .landmarks = {}, .absent = {}};
  Landmark& landmark = alone.landmarks.emplace_back();
  landmark.site = name;
  landmark.point = {point.x(), point.y(), point.z()};
  if (site.direction) {
    const Vec3 unit = Vec3(site.direction->data()).normalized();
    landmark.normal = {unit.x(), unit.y(), unit.z()};
  }
  turns_deg.merge(TurnsOfDowels(alone, data.skull, skull, options));
  Dowel dowel = PlaceDowels(alone, data.skull, skull, options).front();
  dowel.role = IsKnown(name) ? PointRole::kLandmark : PointRole::kInserted;
  return dowel;
}

void CheckApart(const Dowel& dowel, std::span<const Dowel> others) {
  constexpr double kSame_mm = 0.5;  // closer dowels would ask for two depths of one point
  for (const Dowel& other : others) {
    if ((dowel.base - other.base).norm() <= kSame_mm) {
      throw InputError(
          fmt::format("sites.{}: it is at the same place as {}, so one point of the bone has two "
                      "depths; place it "
                      "elsewhere, or set the depth of {} alone",
                      dowel.site, DescribeSite(other.site), other.site));
    }
  }
}

// The name of the first table that has a depth for the site; empty where none has.
std::string TableWith(const TissueOptions& tissue, const std::string& site) {
  for (const std::filesystem::path& path : TissueTableFiles(tissue)) {
    const TissueTable table = ReadTissueTable(path);
    if (FindDepth(table, tissue.sex, tissue.build, site)) {
      return table.id;
    }
  }
  return "";
}

[[noreturn]] void RefuseWithoutDepth(const std::string& name) {
  const std::string near = IsKnown(name) ? "" : NearestWord(name, StandardSiteCodes());
  throw InputError(fmt::format(
      "sites.{}: no depth is given, and no table in use has one; write `depth:` in mm, or `auto` "
      "for the interpolated one{}",
      name, near.empty() ? "" : fmt::format(" (or is '{}' meant?)", near)));
}

// True for a landmark, to which `sites` may only give a (u,v) or a depth. Throws if it is placed
// again.
bool IsLandmark(const std::string& name, const ExtraSite& site, const LandmarkFile& file) {
  if (FindLandmark(file, name) == nullptr) {
    return false;
  }
  if (site.direction) {
    throw InputError(fmt::format(
        "sites.{}.direction: {} is among the landmarks; give that landmark a `normal` instead",
        name, DescribeSite(name)));
  }
  if (!site.near.IsNull()) {
    throw InputError(fmt::format(
        "sites.{}: {} appears twice, as it is among the landmarks; leave `near` out, or "
        "give the site a name of its own",
        name, DescribeSite(name)));
  }
  return true;
}

// Sets the depth that `sites` states. Returns a description of its source.
std::string SetOwnDepth(const AutoOr<double>& depth, Dowel& dowel) {
  dowel.depth_mm = depth.automatic ? kNaN : depth.value;
  return depth.automatic ? "as deep as interpolated there; it changes no other depth"
                         : fmt::format("{} mm, set by hand", depth.value);
}

// Describes the source of a depth that `sites` does not state. Throws InputError if there is none.
std::string DescribeSource(const TissueOptions& tissue, const LandmarkFile& landmarks,
                           const std::string& site) {
  if (!FindSetKey(tissue, site).empty()) {
    return "of tissue.set_mm";
  }
  if (KnownDepths(tissue.given, landmarks).contains(site)) {
    return "known of this person (tissue.given)";
  }
  const std::string table = TableWith(tissue, site);
  if (table.empty()) {
    RefuseWithoutDepth(site);
  }
  return fmt::format("from table '{}'", table);
}

// The keys of set_mm that apply to one of the sites.
std::set<std::string> SetsFor(const TissueOptions& tissue, std::span<const std::string> sites) {
  std::set<std::string> keys;
  for (const std::string& site : sites) {
    keys.insert(FindSetKey(tissue, site));
  }
  return keys;
}

// Removes the entries of set_mm that apply to inserted dowels and to no landmark. Filling the
// landmarks' depths would report them as unused.
void LeaveToInserted(std::span<const std::string> inserted, const LandmarkFile& landmarks,
                     TissueOptions& tissue) {
  std::vector<std::string> sites;
  std::ranges::transform(landmarks.landmarks, std::back_inserter(sites), &Landmark::site);
  const std::set<std::string> theirs = SetsFor(tissue, inserted), ours = SetsFor(tissue, sites);
  std::erase_if(tissue.set_mm, [&](const auto& entry) {
    return theirs.contains(entry.first) && !ours.contains(entry.first);
  });
}

// Fills the depths that `sites` does not state, as for landmarks. Returns notes.
std::vector<std::string> FillTissueDepths(TissueOptions tissue, const LandmarkFile& landmarks,
                                          std::vector<Dowel>& dowels) {
  if (dowels.empty()) {
    return {};
  }
  std::vector<std::string> sites;
  std::ranges::transform(dowels, std::back_inserter(sites), &Dowel::site);
  const std::set<std::string> sets = SetsFor(tissue, sites);
  std::erase_if(tissue.set_mm, [&](const auto& entry) { return !sets.contains(entry.first); });
  std::vector<std::string> notes = FillDepths(tissue, landmarks, dowels);
  ConditionDepths(tissue, landmarks, dowels);  // the landmarks have given its notes already
  return notes;
}

// True if the tissue options state a depth at the site.
bool HasDepth(const TissueOptions& tissue, const LandmarkFile& landmarks, const std::string& site) {
  return !FindSetKey(tissue, site).empty() || KnownDepths(tissue.given, landmarks).contains(site) ||
         (tissue.depths == DepthSource::kTable && !TableWith(tissue, site).empty());
}

// Gives each dowel its depth. Returns notes on the sources of the depths, then those of the tissue.
std::vector<std::string> GiveInserted(const Experiment& experiment, const LandmarkFile& landmarks,
                                      std::vector<Dowel>& dowels) {
  std::vector<Dowel> of_tissue;
  for (const Dowel& dowel : dowels) {
    if (!experiment.sites.at(dowel.site).depth) {
      DescribeSource(experiment.tissue, landmarks, dowel.site);  // throws if there is none
      of_tissue.push_back(dowel);
    }
  }
  const std::vector<std::string> more = FillTissueDepths(experiment.tissue, landmarks, of_tissue);
  std::vector<std::string> notes;
  for (Dowel& dowel : dowels) {
    const auto& own = experiment.sites.at(dowel.site).depth;
    const auto filled = std::ranges::find(of_tissue, dowel.site, &Dowel::site);
    dowel = filled == of_tissue.end() ? dowel : *filled;
    notes.push_back(
        fmt::format("site {}: dowel inserted, {}", DescribeSite(dowel.site),
                    own ? SetOwnDepth(*own, dowel)
                        : fmt::format("{:.4g} mm, {}", dowel.depth_mm,
                                      DescribeSource(experiment.tissue, landmarks, dowel.site))));
  }
  notes.insert(notes.end(), more.begin(), more.end());
  return notes;
}

bool IsNamed(const NetworkPlan& plan, const std::string& site) {
  return std::ranges::any_of(plan.areas, [&site](const auto& area) {
    return std::ranges::find(area, site) != area.end();
  });
}

// The value at a point of a triangle, from those of its corners that have one. NaN if none has.
double ValueAt(const MeshPoint& at, const Triangle& corners, std::span<const double> values_mm) {
  double sum = 0, weights = 0;
  for (int k = 0; k < 3; ++k) {
    const double mm = values_mm[corners[k]];
    if (std::isfinite(mm)) {
      sum += at.weights[k] * mm;
      weights += at.weights[k];
    }
  }
  return weights > 0 ? sum / weights : kNaN;
}

// The sites at which dowels are carried. The masseter and the parotid region gain nothing.
constexpr std::array kCarried = {"tf_l", "tf_r", "ut_l", "ut_r"};

// Places on the bone by site, or why there are none.
struct CarriedPlaces {
  std::map<std::string, Vec3> places;
  std::string fault;
};

// The carried sites that are neither a landmark nor one of `sites`, where people's mean bone has
// them when it is laid on the skull. With interpolated depths there, one of three heads gains 0.04
// mm and two lose less than 0.01 mm (configs/studies/carried_sites.yaml).
CarriedPlaces FindCarriedPlaces(const Experiment& experiment, const SubjectData& data,
                                const Case& subject, const RunContext& context) {
  if (std::holds_alternative<PhantomOptions>(experiment.subject)) {
    return {{}, "a phantom's skull is not a person's"};
  }
  const interp::DepthInput input{.skull = data.skull,
                                 .normals = {},
                                 .dowels = subject.dowels_on_bone,
                                 .network = subject.network};
  const interp::CarriedBone bone = CarryToSubject(interp::CarriedPeople(), input, context);
  CarriedPlaces found{{}, bone.fault};
  for (const char* const site : kCarried) {
    const auto place = bone.sites.find(site);
    if (place != bone.sites.end() && !experiment.sites.contains(site) &&
        FindLandmark(data.landmarks, site) == nullptr) {
      found.places.insert(*place);
    }
  }
  return found;
}

// The dowels at carried sites: those with a depth of their own, then those that take the
// interpolated one. A site that a table lacks gets no dowel: with a table's depths the interpolated
// one made the face of the demo worse (2.65 -> 2.76 mm).
struct CarriedDowels {
  std::vector<Dowel> filled, open;
};
CarriedDowels MakeCarriedDowels(const Experiment& experiment, const SubjectData& data,
                                const MeshQuery& skull, const std::map<std::string, Vec3>& places) {
  CarriedDowels carried;
  for (const auto& [site, place] : places) {
    std::map<std::string, double> turns_deg;  // none, because no direction is given
    Dowel dowel = OnBone(site, place, ExtraSite{}, data, skull, experiment.landmarks, turns_deg);
    dowel.role = PointRole::kInserted;
    if (HasDepth(experiment.tissue, data.landmarks, site)) {
      carried.filled.push_back(std::move(dowel));
    } else if (experiment.tissue.AreMeasured()) {
      carried.open.push_back(std::move(dowel));
    }
  }
  return carried;
}

std::string NoteCarried(std::span<const Dowel> dowels, std::string_view depths) {
  std::vector<std::string> sites;
  std::ranges::transform(dowels, std::back_inserter(sites), &Dowel::site);
  return fmt::format("dowels added at {}, where the mean bone of people has them, {}",
                     fmt::join(sites, ", "), depths);
}

std::string WhyNoneIsCarried(const CarriedPlaces& found) {
  if (!found.fault.empty()) {
    return found.fault;
  }
  return found.places.empty() ? "every site of it is placed already, or lacks bone"
                              : "no table in use has a depth at its sites";
}

}  // namespace

TissueOptions WithSiteDepths(const Experiment& experiment, const LandmarkFile& landmarks) {
  TissueOptions tissue = experiment.tissue;
  std::vector<std::string> inserted;
  for (const auto& [name, site] : experiment.sites) {
    if (site.depth && experiment.tissue.set_mm.contains(name)) {
      throw InputError(fmt::format(
          "sites.{}.depth: the depth appears twice, here and in tissue.set_mm; leave one out",
          name));
    }
    const bool is_landmark = IsLandmark(name, site, landmarks);
    if (!is_landmark && !site.depth && IsKnown(name)) {
      inserted.push_back(name);
    }
    if (!is_landmark || !site.depth) {
      continue;
    }
    if (site.depth->automatic) {
      throw InputError(fmt::format(
          "sites.{}.depth: auto is for a site that is not among the landmarks; give mm", name));
    }
    tissue.set_mm.emplace(name, site.depth->value);
  }
  if (experiment.landmarks.carried == CarriedSites::kPeople) {
    inserted.insert(inserted.end(), kCarried.begin(), kCarried.end());
  }
  LeaveToInserted(inserted, landmarks, tissue);
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
          DescribeSite(name)));
    }
    Dowel dowel = OnBone(name, placing.At(name, site), site, data, skull, experiment.landmarks,
                         subject.turns_deg);
    CheckApart(dowel, subject.dowels_on_bone);
    CheckApart(dowel, inserted);
    inserted.push_back(std::move(dowel));
  }
  const std::vector<std::string> notes = GiveInserted(experiment, data.landmarks, inserted);
  subject.notes.insert(subject.notes.end(), notes.begin(), notes.end());
  for (Dowel& dowel : inserted) {
    (std::isnan(dowel.depth_mm) ? subject.open_dowels : subject.dowels_on_bone)
        .push_back(std::move(dowel));
  }
}

void InsertCarriedDowels(const Experiment& experiment, const SubjectData& data,
                         const MeshQuery& skull, const RunContext& context, Case& subject) {
  if (experiment.landmarks.carried == CarriedSites::kNone) {
    return;
  }
  const CarriedPlaces found = FindCarriedPlaces(experiment, data, subject, context);
  CarriedDowels carried = MakeCarriedDowels(experiment, data, skull, found.places);
  const std::vector<std::string> notes =
      FillTissueDepths(experiment.tissue, data.landmarks, carried.filled);
  if (!carried.filled.empty()) {
    subject.notes.push_back(NoteCarried(carried.filled, "as deep as the tissue options state"));
  }
  if (!carried.open.empty()) {
    subject.notes.push_back(
        NoteCarried(carried.open, "as deep as interpolated there; they change no other depth"));
  }
  if (carried.filled.empty() && carried.open.empty()) {
    subject.notes.push_back(
        fmt::format("landmarks.carried: no dowel is added: {}", WhyNoneIsCarried(found)));
  }
  std::ranges::copy(notes, std::back_inserter(subject.notes));
  std::ranges::move(carried.filled, std::back_inserter(subject.dowels_on_bone));
  std::ranges::move(carried.open, std::back_inserter(subject.open_dowels));
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
        notes.push_back(
            fmt::format("site {}: outside the dowel network, which got an area more there",
                        DescribeSite(site)));
        break;
      case Insertion::kNone:
        notes.push_back(
            fmt::format("site {}: outside the dowel network, and no area joins it: schemes that "
                        "work on the network do not use its depth",
                        DescribeSite(site)));
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
    const Triangle& corners = shell.triangles[at.triangle];
    dowel.depth_mm = ValueAt(at, corners, depth.depth_mm);
    dowel.sd_mm = ValueAt(at, corners, depth.sd_mm);
    if (std::isfinite(dowel.depth_mm)) {
      subject.dowels_on_bone.push_back(dowel);
    } else {
      subject.notes.push_back(fmt::format("site {}: no depth is interpolated there; dowel left out",
                                          DescribeSite(dowel.site)));
    }
  }
  subject.open_dowels.clear();
}

}  // namespace semblance::problems
